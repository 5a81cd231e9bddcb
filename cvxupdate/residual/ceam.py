"""Eigenstructure assignment as linear equations in the parameters (6.22, 6.23), each mode's rows whitened by its own deviations.

For a mode (s, φ) of the real structure, Z(s, p) φ = 0 with Z = s² M + s C + K + i D. Where K, M, C, D are linear in p and φ is known at every
DOF this is *exactly* linear in p: one convex step is the whole method. Where some DOFs were not measured they are expanded by the model at ``at``
and given deviations as large as they are, so that whitening all but projects them out; with the shapes expanded anew at each solution this is the
variable projection of Golub and Pereyra (1973) in Kaufman's form (1975), which converges like Gauss–Newton.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.errors import ConvergenceError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import DerivativeBlock, Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.ceam_expand import expand
from cvxupdate.residual.ceam_modes import AssignedMode, impedance
from cvxupdate.system import LinearSystem

Array = NDArray[Any]
FLOOR = 1e-6  # of each row's own deviation: what whitening leaves where the deviations alone would be singular


@dataclass(frozen=True)
class CeamResidual:
    """What is assigned: ``assigned`` modes of ``model``, ``expansion`` for incomplete ones, and the parameter values ``at`` at which the rows
    are whitened and the shapes expanded; ``modes`` of the model for the modal expansions."""

    model: Model
    assigned: tuple[AssignedMode, ...]
    expansion: str
    at: Real
    modes: Modes | None = None

    @cached_property
    def expanded(self) -> tuple[Array, ...]:
        """Shapes at all DOFs by the model at ``at``."""
        m = self.model.matrices(self.at)
        return tuple(expand(mode, m, self.expansion, self.modes) for mode in self.assigned)

    @cached_property
    def whiteners(self) -> tuple[Array, ...]:
        """Upper triangular R of each mode with Rᴴ R the covariance of its rows."""
        m = self.model.matrices(self.at)
        return tuple(whitener(m, mode, full) for mode, full in zip(self.assigned, self.expanded, strict=True))

    @property
    def exact(self) -> bool:
        """Whether the equations hold for every p and not near ``at`` only: every shape is complete (the model must be linear in p too)."""
        return all(mode.full(self.model.size) for mode in self.assigned)

    def evaluate(self, p: Real, before: CeamPoint | None = None) -> CeamPoint:
        """The equations at ``p``."""
        del before
        return CeamPoint(self, np.asarray(p, dtype=float), self.model.matrices(p))


@dataclass(frozen=True)
class CeamPoint:
    """The equations at one parameter vector."""

    residual: CeamResidual
    p: Real
    matrices: Matrices

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(whitened Z(p) φ, ones, labels): real parts, then imaginary parts, mode by mode."""
        values = []
        for mode, R, full in zip(self.residual.assigned, self.residual.whiteners, self.residual.expanded, strict=True):
            values.append(parts(white(R, impedance(self.matrices, mode) @ full), mode.real))
        flat = np.concatenate(values)
        return flat, np.ones(len(flat)), self.labels

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Row labels."""
        out = []
        for mode, R in zip(self.residual.assigned, self.residual.whiteners, strict=True):
            out += [f"{mode.label}: equation {i + 1}{part}" for part in ([""] if mode.real else [" (real)", " (imaginary)"]) for i in range(len(R))]
        return tuple(out)

    def system(self) -> LinearSystem:
        """A p − b = whitened Z(p) φ at this point and, where the model is linear and the shapes are complete, everywhere."""
        model = self.residual.model
        derivatives = [model.derivative(j, self.p) for j in range(len(model.parameters))]
        rows = []
        for mode, R, full in zip(self.residual.assigned, self.residual.whiteners, self.residual.expanded, strict=True):
            rows.append(parts(white(R, forces(derivatives, mode, full)), mode.real))
        A = np.vstack(rows)
        values, weights, labels = self.differences
        return LinearSystem(A, A @ self.p - values, weights, tuple(q.name for q in model.parameters), labels)


def forces(derivatives: Sequence[Sequence[DerivativeBlock]], mode: AssignedMode, full: Array) -> Array:
    """∂Z/∂p_j φ for every parameter, (N, parameters)."""
    out = np.zeros((len(full), len(derivatives)), dtype=float if mode.real else complex)
    padded = np.append(full, 0.0)
    factors = {"K": 1.0, "M": float((mode.s**2).real)} if mode.real else {"K": 1.0, "M": mode.s**2, "C": mode.s, "D": 1j}
    for j, blocks in enumerate(derivatives):
        for b in blocks:
            local = padded[b.dofs]
            push: Any = 0.0
            for name, factor in factors.items():
                matrix = getattr(b, name)
                if matrix is not None:
                    push = push + factor * np.einsum("eij,ej->ei", matrix, local)
            if not np.isscalar(push):
                keep = b.dofs >= 0
                np.add.at(out[:, j], b.dofs[keep], push[keep])
    return out


def whitener(m: Matrices, mode: AssignedMode, full: Array) -> Array:
    """Upper triangular R with Rᴴ R = covariance of Z φ, from the deviations of shape and rate to first order (Pintelon and Schoukens 2012, ch. 9).

    The factors are put side by side, G = [Z S^½, (∂Z/∂s φ) s σ, floor], and R comes from the QR of Gᴴ: the product G Gᴴ, whose condition is
    the square of Z's, is never formed. Raises `ConvergenceError` when rounding leaves it singular.
    """
    Z = np.asarray(impedance(m, mode).toarray())
    moved = (2.0 * mode.s * (m.M @ full) + m.C @ full) * mode.s * mode.rate_std
    column = np.real(2.0 * mode.s**2 * (m.M @ full)) * mode.rate_std if mode.real else moved
    std = np.zeros(len(full))
    std[mode.at] = mode.std
    missing = np.setdiff1d(np.arange(len(full)), mode.at)
    # An expanded entry is known no better than its own size: the model that expanded it is the one in doubt.
    std[missing] = max(float(mode.std.max()), float(np.abs(full[missing]).max(initial=0.0)))
    G = np.column_stack([Z * std[None, :], column])
    R = la.qr(np.column_stack([G, np.diag(FLOOR * np.linalg.norm(G, axis=1))]).conj().T, mode="r")[0][: len(G)]
    if np.any(np.abs(np.diag(R)) == 0.0):
        raise ConvergenceError(f"{mode.label}: the covariance of its equations is singular; give its shape a deviation above 0.")
    return np.asarray(R)


def white(R: Array, force: Array) -> Array:
    """R⁻ᴴ force."""
    return np.asarray(la.solve_triangular(R, force, trans="C"))


def parts(values: Array, real: bool) -> Real:
    """Real rows of an undamped mode; real rows, then imaginary ones (each with half the variance) of a complex one."""
    if real:
        return np.asarray(values.real)
    return np.asarray(np.sqrt(2.0) * np.concatenate([values.real, values.imag]))
