"""The direct methods by name, each with what it changes and what it is known to do wrong (2.7); one
line makes a method known to problem files and pages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.assignment import minas_inman, zimmerman_widengren
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
from cvxupdate.direct.inman_minas import inman_minas
from cvxupdate.direct.mixing import caesar_link, luk, ross
from cvxupdate.direct.placement import modal_control, pole_placement
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.direct.wei import wei
from cvxupdate.direct.weighted import he_ewins, park_lee

Real = NDArray[np.float64]
SHAPE_STD, FREQUENCY_STD = 0.01, 1e-3
"""Deviations taken where none was given: of a shape's largest entry, of a frequency."""


@dataclass(frozen=True, eq=False)
class Request:
    """What every method is given: ``K``, ``M`` (N, N) of the model; measured ``Phi`` (N, m) at all
    DOFs, unit modal mass, with ``eigenvalues`` (m,) ω²; ``own`` (N, m) and ``own_eigenvalues`` of
    the model's modes that they are paired with, whose places (0 = lowest, rigid-body modes counted)
    are ``partners``.

    ``zeta`` (m,) fractions of critical (0 where none was measured), ``waves`` (N, m) the shapes as
    measured, complex where they are, Φᵀ M Φ = 1 for each; ``shape_std`` (N, m) and
    ``eigenvalue_std`` (m,) deviations of Phi and eigenvalues. None: no damping, real shapes, a part
    in a hundred of the largest entry and 2 in a thousand.
    """

    K: Real
    M: Real
    Phi: Real
    eigenvalues: Real
    own: Real
    own_eigenvalues: Real
    partners: NDArray[np.int64]
    zeta: Real | None = None
    waves: NDArray[Any] | None = None
    shape_std: Real | None = None
    eigenvalue_std: Real | None = None

    @property
    def C(self) -> Real:
        """The model's damping, which these methods leave out."""
        return np.zeros_like(self.K)

    @property
    def ratios(self) -> Real:
        """Fractions of critical, (m,)."""
        return np.zeros(len(self.eigenvalues)) if self.zeta is None else self.zeta

    @property
    def rates(self) -> NDArray[np.complex128]:
        """s = ω (−ζ + i √(1 − ζ²)), (m,)."""
        z = self.ratios
        return np.asarray(np.sqrt(self.eigenvalues) * (-z + 1j * np.sqrt(1.0 - z**2)))

    @property
    def complex_eigenvalues(self) -> NDArray[np.complex128]:
        """ω² (1 + 2 i ζ), (m,)."""
        return np.asarray(self.eigenvalues * (1.0 + 2j * self.ratios))

    @property
    def complex_shapes(self) -> NDArray[Any]:
        """The shapes as complex ones."""
        return self.Phi.astype(np.complex128)

    @property
    def deviations(self) -> tuple[Real, Real]:
        """Of the shapes (N, m) and of the eigenvalues (m,)."""
        shape = self.shape_std
        value = self.eigenvalue_std
        return (
            np.broadcast_to(SHAPE_STD * np.abs(self.Phi).max(axis=0), self.Phi.shape)
            if shape is None
            else shape,
            2.0 * FREQUENCY_STD * self.eigenvalues if value is None else value,
        )

    def asked(self, made: DirectUpdate) -> tuple[NDArray[Any], NDArray[Any]]:
        """Shapes (N, m) and eigenvalues (m,) that ``made`` was to have, as `faults` takes them."""
        if made.C is not None:
            return self.complex_shapes, self.rates
        if made.D is not None:
            waves = self.complex_shapes if self.waves is None else self.waves
            return waves, self.complex_eigenvalues
        return self.Phi, self.eigenvalues


@dataclass(frozen=True)
class DirectMethod:
    """``name`` in a problem file, ``title``, ``equations`` of the thesis, what it ``changes`` and
    keeps, ``apply(request)``, and whether it ``needs_shapes`` that were measured."""

    name: str
    title: str
    equations: str
    changes: str
    apply: Callable[[Request], DirectUpdate]
    needs_shapes: bool = True


def _error(name: str, dK: Real, r: Request, dM: Real | None = None) -> DirectUpdate:
    return DirectUpdate(name, r.M if dM is None else r.M + dM, r.K + dK)


def _sidhu(r: Request) -> DirectUpdate:
    # what was not measured stays the model's, as in (2.91): its modes cancel in the difference
    measured, own = flexibility(r.Phi, r.eigenvalues), flexibility(r.own, r.own_eigenvalues)
    return _error("Sidhu and Ewins", sidhu_ewins(r.K, measured, own), r)


def _second(r: Request) -> DirectUpdate:
    measured, own = flexibility(r.Phi, r.eigenvalues), flexibility(r.own, r.own_eigenvalues)
    return _error("Zhang and Lallement", second_order(r.K, measured, own), r)


def _he(r: Request) -> DirectUpdate:
    waves = r.complex_shapes if r.waves is None else r.waves
    own = flexibility(r.own, r.own_eigenvalues)
    dK, D = he_ewins(r.K, waves, r.complex_eigenvalues, own)
    return DirectUpdate("He and Ewins", r.M, r.K + dK, None, D)


def _park(r: Request) -> DirectUpdate:
    dK, _ = park_lee(r.K, r.own, r.own_eigenvalues, r.Phi, r.eigenvalues, *r.deviations)
    return _error("Park and Lee", dK, r)


def _orthogonal(r: Request) -> NDArray[Any]:
    """The shapes made orthogonal in the mass, without which no symmetric K has them."""
    return baruch_shapes(r.M, r.Phi).astype(np.complex128)


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
            _orthogonal(r),
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
    DirectMethod(
        "he-ewins",
        "He and Ewins 1986",
        "2.90",
        "error matrix of complex modes: stiffness and hysteretic damping",
        _he,
    ),
    DirectMethod(
        "park-lee",
        "Park and Lee 1988",
        "2.91",
        "error matrix, each entry weighted by its deviation, on the model's pattern alone",
        _park,
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
    DirectMethod(
        "inman-minas",
        "Inman and Minas 1990",
        "2.7.4",
        "as Minas and Inman, iterated until symmetric; shapes made orthogonal in the mass",
        lambda r: inman_minas(r.K, r.M, r.C, _orthogonal(r), r.rates),
    ),
    DirectMethod(
        "zimmerman-widengren",
        "Zimmerman and Widengren 1990",
        "2.7.4",
        "symmetric assignment of least rank; shapes made orthogonal in the mass",
        lambda r: zimmerman_widengren(r.K, r.M, r.C, _orthogonal(r), r.rates),
    ),
    DirectMethod(
        "pole-placement",
        "Porter and Crossley 1972",
        "2.7.4",
        "frequencies alone, the shapes stay the model's",
        lambda r: pole_placement(r.K, r.M, r.own, r.own_eigenvalues, r.eigenvalues),
        False,
    ),
    DirectMethod(
        "modal-control",
        "Porter and Crossley 1972, one actuator",
        "2.7.4",
        "frequencies alone, by feedback to one actuator",
        lambda r: modal_control(r.K, r.M, r.own, r.own_eigenvalues, r.eigenvalues),
        False,
    ),
)
NAMES = tuple(m.name for m in METHODS)
