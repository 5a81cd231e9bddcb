"""Output error on a reduced basis: modes and static residual vectors, so that an iteration costs
nothing that grows with the model.

With V (N, k) the receptances are B (VᵀZV)⁻¹ Bᵀ, B = V at the sensors and forces, and ∂Z/∂p_j enters
as Vᵀ ∂K_j V and so on, formed once. They belong to the parameters ``at``: K(p) ≈ VᵀK V + Σ Δp_j
VᵀK_jV is exact for p-values and first order for others, and the basis is best near ``at``;
`update.rfm_loop` makes it anew when the parameters have moved, and ends with the full model's word
(Balmès 1996; Craig and Bampton 1968 for the residual vectors).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis import Galerkin
from cvxupdate.residual.contraction import CHUNK, Derivatives, derivatives
from cvxupdate.residual.frf import FrfPoint, FrfResidual, parts
from cvxupdate.system import LinearSystem

Field = NDArray[Any]
BEYOND = 1.5  # modes are kept up to this multiple of the highest line
MODES = 400


@dataclass(frozen=True)
class Basis:
    """``V`` (N, k), orthonormal in M, made at ``p``; reduced K, M, C, D (k, k) and their
    derivatives (parameters, k, k), None where zero."""

    p: Real
    V: Real
    matrices: Galerkin
    change: dict[str, Real | None]

    def at(self, p: Real) -> Galerkin:
        """Reduced K, M, C, D at ``p``."""
        step = p - self.p
        return replace(
            self.matrices,
            **{
                name: getattr(self.matrices, name) + np.tensordot(step, change, axes=1)
                for name, change in self.change.items()
                if change is not None
            },
        )


def make_basis(
    model: Model, p: Real, top: float, places: Index, shifts: tuple[float, ...]
) -> Basis:
    """Modes up to 1.5 ``top`` (Hz) and the responses to unit forces at ``places`` at each of
    ``shifts`` (Hz).

    With one low shift these are the residual vectors in which the modes left out answer statically;
    at each further shift the basis is exact as well.

    Raises
    ------
    ModelError
        When the model at ``p`` is no structure, has modal damping, or carries more than 400 modes
        in the band.
    """
    if model.modal_damping and any(model.modal_damping):
        raise ModelError(
            "a reduced basis needs element damping. Use structural or Rayleigh damping, or "
            "the full model."
        )
    m = model.matrices(p)
    count = 20
    while True:
        modes = model_modes(model, min(count, model.size), p, m)
        if modes.frequencies[-1] > BEYOND * top or len(modes.frequencies) >= model.size:
            break
        if count >= MODES:
            raise ModelError(
                f"the model has more than {MODES} modes below {BEYOND * top:.5g} Hz. Narrow "
                "the band, or use the full model."
            )
        count *= 2
    shapes = modes.shapes[:, modes.frequencies <= BEYOND * top]
    unit = np.zeros((model.size, len(places)))
    unit[places, np.arange(len(places))] = 1.0
    static = [
        factored(
            sp.csc_array(m.K - (2 * np.pi * f) ** 2 * m.M), f"the dynamic stiffness at {f:g} Hz"
        ).solve(unit)
        for f in shifts
    ]
    return reduce_to(model, p, m, orthonormal(np.hstack([shapes, *static]), m.M))


def orthonormal(V: Real, M: sp.csc_array) -> Real:
    """A basis of the columns of V, orthonormal in M; directions below 1e-10 of the largest, or
    without mass, are made orthonormal as they are."""
    V = V / np.linalg.norm(V, axis=0)
    V = la.qr(V, mode="economic", pivoting=True)[0]
    w, X = la.eigh(V.T @ (M @ V))
    return np.asarray(V @ (X / np.sqrt(np.maximum(w, 1e-12 * w[-1]))))


def reduce_to(model: Model, p: Real, m: Matrices, V: Real) -> Basis:
    """VᵀKV … and VᵀK_jV … by element blocks."""
    matrices = Galerkin(*(np.asarray(V.T @ (getattr(m, name) @ V)) for name in "KMCD"))
    d = derivatives(model, p)
    return Basis(p, V, matrices, {name: _projected(d, V, name) for name in "KMCD"})


def _projected(d: Derivatives, V: Real, name: str) -> Real | None:
    if all(getattr(part, name) is None for part in d.parts):
        return None
    k = V.shape[1]
    out = np.zeros((d.count, k, k))
    padded = np.vstack([V, np.zeros((1, k))])
    for part in d.parts:
        values = getattr(part, name)
        if values is None:
            continue
        cuts = np.append(np.flatnonzero(np.diff(part.column, prepend=-1)), len(part.column))
        for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
            for begin in range(
                first, last, CHUNK
            ):  # VᵀKV of one parameter's elements as one product of tall matrices
                some = slice(begin, min(begin + CHUNK, last))
                local = padded[part.dofs[some]]
                push = values[some] @ local
                out[part.column[first]] += local.reshape(-1, k).T @ push.reshape(-1, k)
    return out


@dataclass(frozen=True)
class ReducedResidual:
    """`FrfResidual` of kind "receptance" on a basis."""

    full: FrfResidual
    basis: Basis

    def evaluate(self, p: Real, before: ReducedPoint | None = None) -> ReducedPoint:
        """Rows and derivatives at ``p`` (n,)."""
        reduced = self.basis.at(p)
        lossy = not self.full.real
        values, rows = [], []
        count = len(p)
        for data in self.full.data:
            B, F = self.basis.V[data.responses], self.basis.V[data.references]
            for k, f in enumerate(data.frequency.tolist()):
                w = 2.0 * np.pi * f
                Z = reduced.stiffness(np.array([1j * w]), lossy)[0]
                X = np.linalg.solve(Z, np.hstack([B.T, F.T]))
                left, right = X[:, : len(B)], X[:, len(B) :]
                values.append((B @ right - data.X[k])[data.used])
                # −leftᵀ ∂Z right = Σ over (k, k) of −outer(left, right) · ∂Z: one product with the
                # flattened derivatives
                pairs = (left[:, None, :, None] * right[None, :, None, :]).reshape(
                    X.shape[0] ** 2, -1
                )[:, data.used.reshape(-1)]
                out: Field = np.zeros((count, pairs.shape[1]), dtype=pairs.dtype)
                for name, factor in (("K", 1.0), ("M", -(w**2)), ("C", 1j * w), ("D", 1j)):
                    change = self.basis.change[name]
                    if change is not None:
                        out = out + factor * (change.reshape(count, -1) @ pairs)
                rows.append(-out.T)
        real = self.full.real
        return ReducedPoint(
            self,
            np.asarray(p, dtype=float),
            parts(np.concatenate(values), real),
            parts(np.concatenate(rows), real),
        )


@dataclass(frozen=True)
class ReducedPoint:
    """`FrfPoint` on a basis."""

    residual: ReducedResidual
    p: Real
    values: Real
    jacobian: Real

    @property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows."""
        return self.values, self.residual.full.weights, self.residual.full.labels

    def system(self) -> LinearSystem:
        """Linearised at this point."""
        return self.as_full().system()

    def as_full(self) -> FrfPoint:
        """The same rows as a point of the full residual."""
        return FrfPoint(self.residual.full, self.p, self.values, self.jacobian)
