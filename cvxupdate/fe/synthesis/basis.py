"""The basis of the modal and the reduced way: modes up to a multiple of the band, and static
corrections for the rest.

Beyond its modes Φ the model answers almost statically. R₁ = K⁻¹F less its part in Φ is that answer
(residual attachment modes: Craig and Bampton 1968); R_{j+1} = K⁻¹M R_j, K⁻¹D R_j and K⁻¹C R_j
follow its slow change with frequency, each order matching two more moments of H in s² (Balmès
1996). In the space of the corrections K and M are made diagonal as well, K to 1, so that a motion
without mass stands beside the others. A model that is small is not truncated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factored, factored
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes

WHOLE = 300
"""DOFs up to which every mode is taken: LAPACK finds them all as soon as it finds some."""
BEYOND = 2.0
"""Modes are taken up to this many times the highest point."""
SAME = 1e-9
"""Of the largest static correction: below it is what the others say already."""
ROUNDING = 1e-13
"""Of the largest singular value of a damping matrix: below is rounding."""
SHIFT = 0.05
"""Of the lowest flexible eigenvalue: the shift by which a free structure has a static answer."""


@dataclass(frozen=True)
class Basis:
    """``V`` (N, k) in which K is diag ``kappa``, M is diag ``mu`` (k,), both without rigid-body
    parts mixed in; the damping that is proportional to them has the diagonals ``viscous`` and
    ``loss`` (k,), the rest couples: ``C`` and ``D`` (k, k), None where there is none."""

    V: Real
    kappa: Real
    mu: Real
    viscous: Real
    loss: Real
    C: Real | None = None
    D: Real | None = None

    @property
    def size(self) -> int:
        """Number of vectors k."""
        return self.V.shape[1]

    @cached_property
    def rank(self) -> int:
        """Columns of the damping that couples."""
        return sum(len(columns(part)[0]) for part in (self.C, self.D) if part is not None)


def columns(A: Real) -> tuple[Real, Real, Real]:
    """Singular values (r,), left and right vectors (k, r) of a matrix that are not rounding."""
    left, values, right = la.svd(A)
    kept = values > ROUNDING * values.max(initial=0.0)
    return values[kept], left[:, kept], right[kept].T


@dataclass(frozen=True)
class Subspace:
    """What every basis of one model grows from: its modes, the factors of K (shifted where the
    structure is free), the ``ports`` (places of forces and sensors)."""

    model: Model
    m: Matrices
    modes: Modes
    ports: Index

    @classmethod
    def of(cls, model: Model, m: Matrices, p: Real | None, top: float, ports: Index) -> Subspace:
        """For points up to ``top`` Hz."""
        return cls(model, m, _modes(model, m, p, top), ports)

    @property
    def complete(self) -> bool:
        """Whether the modes are all the model has."""
        return len(self.modes.eigenvalues) >= self.model.size

    @cached_property
    def factor(self) -> Factored:
        """Of K, shifted by a little of M where the structure is free."""
        flexible = self.modes.flexible().eigenvalues
        shift = SHIFT * float(flexible[0]) if self.modes.rigid and len(flexible) else 0.0
        return factored(sp.csc_array(self.m.K + shift * self.m.M), "the stiffness")

    def basis(self, blocks: int) -> Basis:
        """With static corrections of ``blocks`` orders."""
        R = self._corrections(blocks)
        lam = np.maximum(self.modes.eigenvalues, 0.0)
        V, kappa, mu = self.modes.shapes, lam, np.ones(len(lam))
        if R.shape[1]:
            stiff, massive = R.T @ (self.m.K @ R), R.T @ (self.m.M @ R)
            light, X = la.eigh((massive + massive.T) / 2.0, (stiff + stiff.T) / 2.0)
            V = np.hstack([V, R @ X])
            kappa = np.concatenate([kappa, np.ones(len(light))])
            mu = np.concatenate([mu, np.maximum(light, 0.0)])
        alpha, beta, eta = (_common(self.model, k) for k in ("alpha", "beta", "eta"))
        m = self.m
        return Basis(
            V,
            kappa,
            mu,
            alpha * mu + beta * kappa,
            eta * kappa,
            _coupling(V, m.C, alpha * m.M + beta * m.K),
            _coupling(V, m.D, eta * m.K),
        )

    def _corrections(self, blocks: int) -> Real:
        N = self.model.size
        if self.complete or not blocks:
            return np.zeros((N, 0))
        unit = np.zeros((N, len(self.ports)))
        unit[self.ports, np.arange(len(self.ports))] = 1.0
        lossy = [A for A in (self.m.C, self.m.D) if np.any(A.data)]
        found = [self._beyond(self.factor.solve(unit))]
        for _ in range(blocks - 1):
            found.append(
                np.hstack(
                    [
                        _scaled(self._beyond(self.factor.solve(A @ found[-1])))
                        for A in (self.m.M, *lossy)
                    ]
                )
            )
            found[-1] = _independent(found[-1])
        return _independent(self._beyond(_independent(np.hstack([_scaled(R) for R in found]))))

    def _beyond(self, R: Real) -> Real:
        """Less its part in the modes."""
        return np.asarray(R - self.modes.shapes @ (self.modes.shapes.T @ (self.m.M @ R)))


def _modes(model: Model, m: Matrices, p: Real | None, top: float) -> Modes:
    """All of a small model, else those up to `BEYOND` times ``top`` (Hz), by doubling."""
    at = model.zero() if p is None else p
    count = model.size if model.size <= WHOLE else 30
    while True:
        modes = model_modes(model, min(count, model.size), at, m)
        short = len(modes.eigenvalues) - modes.rigid < count
        if count >= model.size or short or modes.frequencies[-1] > BEYOND * top:
            return modes
        count *= 2


def _common(model: Model, key: str) -> float:
    """The value of a damping property that most elements have."""
    values = np.concatenate([np.ravel(b.properties[key]) for b in model.blocks])
    found, often = np.unique(values, return_counts=True)
    return float(found[np.argmax(often)])


def _coupling(V: Real, A: sp.csc_array, proportional: sp.sparray) -> Real | None:
    """Vᵀ(A − proportional)V, None where that is rounding."""
    rest = sp.csc_array(A - proportional)
    largest = max(np.abs(A.data).max(initial=0.0), np.abs(proportional.data).max(initial=0.0))
    rest.data[np.abs(rest.data) <= 1e-14 * largest] = 0.0
    return np.asarray(V.T @ (rest @ V)) if np.any(rest.data) else None


def _scaled(R: Real) -> Real:
    return np.asarray(R / np.maximum(np.linalg.norm(R, axis=0), np.finfo(float).tiny))


def _independent(R: Real) -> Real:
    U, kept, _ = la.svd(_scaled(R), full_matrices=False)
    return np.asarray(U[:, kept > SAME * kept[0]]) if len(kept) else R
