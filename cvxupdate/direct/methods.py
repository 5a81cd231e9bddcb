"""The direct methods by name, each with what it changes and what it is known to do wrong (2.7); one
line makes a method known to problem files and pages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.assignment import minas_inman
from cvxupdate.direct.baruch import baruch, baruch_shapes
from cvxupdate.direct.berman_nagy import berman_nagy
from cvxupdate.direct.caesar import caesar
from cvxupdate.direct.error_matrix import (
    flexibility,
    gysin,
    lieven_ewins,
    second_order,
    sidhu_ewins,
)
from cvxupdate.direct.fuh_chen import fuh_chen
from cvxupdate.direct.mixing import caesar_link, luk, ross
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.direct.wei import wei

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Request:
    """What every method is given: ``K``, ``M`` (N, N) of the model; measured ``Phi`` (N, m) at all
    DOFs, unit modal mass, with ``eigenvalues`` (m,) ω²; ``own`` (N, m) and ``own_eigenvalues`` of
    the model's modes that they are paired with, whose places (0 = lowest, rigid-body modes counted)
    are ``partners``."""

    K: Real
    M: Real
    Phi: Real
    eigenvalues: Real
    own: Real
    own_eigenvalues: Real
    partners: NDArray[np.int64]

    @property
    def C(self) -> Real:
        """No damping: the modes are real."""
        return np.zeros_like(self.K)

    @property
    def rates(self) -> NDArray[np.complex128]:
        """i ω, (m,)."""
        return np.asarray(1j * np.sqrt(self.eigenvalues))

    @property
    def complex_shapes(self) -> NDArray[Any]:
        """The shapes as complex ones."""
        return self.Phi.astype(np.complex128)


@dataclass(frozen=True)
class DirectMethod:
    """``name`` in a problem file, ``title``, ``equations`` of the thesis, what it ``changes`` and
    keeps, and ``apply(request)``."""

    name: str
    title: str
    equations: str
    changes: str
    apply: Callable[[Request], DirectUpdate]


def _error(name: str, dK: Real, r: Request, dM: Real | None = None) -> DirectUpdate:
    return DirectUpdate(name, r.M if dM is None else r.M + dM, r.K + dK)


def _sidhu(r: Request) -> DirectUpdate:
    measured = flexibility(r.Phi, r.eigenvalues)
    # what was not measured stays the model's, as in (2.91): the flexibility of few modes is no
    # inverse of a stiffness
    rest = la.inv(r.K) - flexibility(r.own, r.own_eigenvalues)
    return _error("Sidhu and Ewins", sidhu_ewins(r.K, measured + rest), r)


def _second(r: Request) -> DirectUpdate:
    rest = la.inv(r.K) - flexibility(r.own, r.own_eigenvalues)
    return _error(
        "Zhang and Lallement", second_order(r.K, flexibility(r.Phi, r.eigenvalues) + rest), r
    )


def _gysin(r: Request) -> DirectUpdate:
    dK, dM = gysin(r.K, r.M, r.own, r.own_eigenvalues, r.Phi, r.eigenvalues)
    return _error("Gysin", dK, r, dM)


def _lieven(r: Request) -> DirectUpdate:
    dK, dM = lieven_ewins(r.own, r.own_eigenvalues, r.Phi, r.eigenvalues)
    return _error("Lieven and Ewins", dK, r, dM)


def _ross(r: Request) -> DirectUpdate:
    fill = la.null_space((r.M @ r.Phi).T)
    stiff = fill.T @ r.K @ fill
    mass = fill.T @ r.M @ fill
    values, vectors = la.eigh(stiff, mass)
    return ross(r.Phi, r.eigenvalues, fill @ vectors, values)


METHODS: tuple[DirectMethod, ...] = (
    DirectMethod(
        "baruch",
        "Baruch 1978",
        "2.74 to 2.77",
        "stiffness least, the mass kept; shapes made orthogonal in it",
        lambda r: baruch(r.K, r.M, r.Phi, r.eigenvalues),
    ),
    DirectMethod(
        "berman-nagy",
        "Berman and Nagy 1983",
        "2.78 to 2.83",
        "mass least, then stiffness least",
        lambda r: berman_nagy(r.K, r.M, r.Phi, r.eigenvalues),
    ),
    DirectMethod(
        "caesar",
        "Caesar 1986",
        "after 2.83",
        "as Berman and Nagy, rigid-body motions kept",
        lambda r: caesar(r.K, r.M, r.Phi, r.eigenvalues),
    ),
    DirectMethod(
        "wei",
        "Wei 1990",
        "2.84, 2.85",
        "mass and stiffness least at once",
        lambda r: wei(r.K, r.M, r.Phi, r.eigenvalues, 1.0 / float(np.mean(r.eigenvalues)) ** 2),
    ),
    DirectMethod(
        "fuh-chen",
        "Fuh and Chen 1984",
        "2.7.1",
        "stiffness and damping least, the mass kept; shapes made orthogonal in it",
        lambda r: fuh_chen(
            r.K,
            r.M,
            r.C,
            baruch_shapes(r.M, r.Phi).astype(np.complex128),
            r.rates,
            float(np.mean(r.eigenvalues)),
        ),
    ),
    DirectMethod(
        "caesar-link",
        "Caesar 1987, Link 1987",
        "2.87, 2.88",
        "measured modes in place of the model's own",
        lambda r: caesar_link(r.K, r.M, r.Phi, r.eigenvalues, r.partners),
    ),
    DirectMethod("ross", "Ross 1971", "2.86", "measured modes filled up with vectors", _ross),
    DirectMethod(
        "luk",
        "Luk 1987",
        "2.86",
        "pseudo-inverses of the measured modes alone",
        lambda r: luk(r.Phi, r.eigenvalues),
    ),
    DirectMethod(
        "sidhu-ewins", "Sidhu and Ewins 1984", "2.89, 2.90", "error matrix, first order", _sidhu
    ),
    DirectMethod(
        "second-order",
        "Zhang and Lallement 1987",
        "after 2.90",
        "error matrix, second order",
        _second,
    ),
    DirectMethod("gysin", "Gysin 1986", "2.91", "error matrices of few modes", _gysin),
    DirectMethod("lieven-ewins", "Lieven and Ewins 1990", "2.92", "error matrices by SVD", _lieven),
    DirectMethod(
        "minas-inman",
        "Minas and Inman 1990",
        "2.93 to 2.97",
        "eigenstructure assignment by feedback",
        lambda r: minas_inman(r.K, r.M, r.C, r.complex_shapes, r.rates),
    ),
)
NAMES = tuple(m.name for m in METHODS)
