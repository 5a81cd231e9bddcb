"""The modal dynamic residual (K − λM) φ of measured modes, its unmeasured entries eliminated.

For an undamped mode the forces Z(p) φ, Z = K − λM, are linear in p and in the entries u of φ that
were not measured; the u with the least weighted forces at every p leave a function of p alone. Its
derivative in Kaufman's form (1975) of the variable projection needs no derivative of u. The weights
are those of the measured deviations: to first order the forces of the true structure have the
covariance G Gᵀ, G = [Z S, c], S the deviations of the measured entries, c what the deviation of λ
makes of λMφ (Pintelon and Schoukens 2012, ch. 9). With them the objective is χ² of frequencies and
shapes together, the errors in variables. They depend on p, and are held at ``at``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la

from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.ceam import forces
from cvxupdate.residual.ceam_modes import AssignedMode, assigned_modes, impedance
from cvxupdate.residual.shape_rows import Index
from cvxupdate.system import LinearSystem

DENSE = 1500
"""DOFs up to which the weights of a mode, a full matrix, are formed (18 MB each)."""
FLOOR = 1e-6
"""Of the force that the deviations would make if every entry had one: what is unmodelled all the
same where no measured entry acts, so that no row is infinitely sure."""
RANK = 1e-12  # relative size of a column that the others span


@dataclass(frozen=True)
class DynamicResidual:
    """The modes that are fitted, ``assigned``, and the parameter values ``at`` at which their rows
    are weighted."""

    model: Model
    assigned: tuple[AssignedMode, ...]
    at: Real

    @cached_property
    def weights(self) -> tuple[Real, ...]:
        """The Cholesky factor (N, N) of each mode's covariance."""
        out = []
        for G, least in self.covariances:
            out.append(la.cholesky(G @ G.T + np.diag(least**2), lower=True))
        return tuple(out)

    @cached_property
    def covariances(self) -> tuple[tuple[Real, Real], ...]:
        """(G (N, measured + 1), the least deviation (N,) of each row) of each mode: the forces have
        the covariance G Gᵀ and those squares on its diagonal."""
        m = self.model.matrices(self.at)
        root = 1.0 / np.sqrt(np.where(m.K.diagonal() > 0.0, m.K.diagonal(), m.K.diagonal().max()))
        out = []
        for mode in self.assigned:
            Z = np.asarray(impedance(m, mode).toarray())
            full = _eliminated(mode, Z * root[:, None]).full
            c = 2.0 * abs(mode.s) ** 2 * (m.M @ full) * mode.rate_std
            G = np.column_stack([Z[:, mode.at] * mode.std, c])
            typical = float(np.sqrt(np.mean(mode.std**2)))
            out.append((G, FLOOR * np.sqrt(typical**2 * np.sum(Z**2, axis=1) + c**2)))
        return tuple(out)

    def principal(self, k: int) -> tuple[Real, Real]:
        """(rows (N, N), deviations (N,)) of mode ``k``: W = rows over deviations are its weights,
        up to a rotation, those rows apart that hardly any deviation moves. A deviation is in units
        of the least one."""
        G, least = self.covariances[k]
        scaled = G / least[:, None]
        values, V = la.eigh(scaled @ scaled.T)
        return V.T / least, np.sqrt(1.0 + np.maximum(values, 0.0))

    def unmeasured(self, mode: AssignedMode) -> Index:
        """The free DOFs at which ``mode`` was not measured."""
        return np.setdiff1d(np.arange(self.model.size), mode.at).astype(np.int64)

    @property
    def complete(self) -> bool:
        """Whether every shape was measured at every DOF: the residual is then linear in p."""
        return all(mode.full(self.model.size) for mode in self.assigned)

    def evaluate(self, p: Real, before: DynamicPoint | None = None) -> DynamicPoint:
        """The residual at ``p`` (n,); nothing is followed from ``before``."""
        del before
        p = np.asarray(p, dtype=float)
        m = self.model.matrices(p)
        found = tuple(
            _eliminated(mode, whitened(L, impedance(m, mode).toarray()))
            for mode, L in zip(self.assigned, self.weights, strict=True)
        )
        return DynamicPoint(self, p, found)


def dynamic_residual(model: Model, tables: Sequence[ModeTable], at: Real) -> DynamicResidual:
    """The residual of every measured mode that has a shape, as undamped modes.

    Raises
    ------
    InputError
        When no mode has a shape, a shape has no deviation above 0, the model has exact members
        or more than `DENSE` DOFs.
    """
    if model.exact:
        raise InputError(
            'update.method = "modal-dynamic" needs K and M, and exact members have a dynamic '
            'stiffness instead. Take method "sensitivity", or beams of type beam2d or beam3d.'
        )
    if model.size > DENSE:
        raise InputError(
            f'update.method = "modal-dynamic" forms full matrices and takes up to {DENSE} DOFs; '
            f'the model has {model.size}. Take method "ceam", whose weights are sparse, or '
            '"sensitivity".'
        )
    assigned = assigned_modes(model, tables, "none")
    for mode in assigned:
        if not np.any(mode.std > 0.0):
            raise InputError(
                f"{mode.label}: its shape has no deviation above 0, so its forces cannot be "
                "weighed. State the deviations of its entries, or none."
            )
    return DynamicResidual(model, assigned, at)


@dataclass(frozen=True)
class Eliminated:
    """One mode at one p: weighted forces ``values`` (N,), the shape ``full`` (N,) at all DOFs, and
    an orthonormal ``basis`` (N, r) of what its unmeasured entries can make of the forces."""

    values: Real
    full: Real
    basis: Real

    def projected(self, columns: Real) -> Real:
        """``columns`` (N, n) without what the unmeasured entries take up."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


def _eliminated(mode: AssignedMode, Z: Real) -> Eliminated:
    """The unmeasured entries with the least ‖Z φ‖, ``Z`` (N, N) weighted."""
    N = Z.shape[1]
    rest = np.setdiff1d(np.arange(N), mode.at)
    full = np.zeros(N)
    full[mode.at] = mode.shape
    forced = Z[:, mode.at] @ mode.shape
    Q, R, order = la.qr(Z[:, rest], mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    r = int(np.sum(sizes > RANK * sizes.max(initial=0.0)))
    Q, R = Q[:, :r], R[:r, :r]
    along = Q.T @ forced
    full[rest[order[:r]]] = -la.solve_triangular(R, along)
    return Eliminated(forced - Q @ along, full, np.asarray(Q))


def whitened(L: Real, columns: Any) -> Real:
    """L⁻¹ columns."""
    return np.asarray(la.solve_triangular(L, columns, lower=True))


@dataclass(frozen=True)
class DynamicPoint:
    """The residual at ``p`` (n,): ``modes`` one by one."""

    residual: DynamicResidual
    p: Real
    modes: tuple[Eliminated, ...]

    @property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(weighted forces, ones, labels), mode by mode."""
        values = np.concatenate([found.values for found in self.modes])
        labels = tuple(
            f"{mode.label}: force at {label}"
            for mode in self.residual.assigned
            for label in self.residual.model.labels
        )
        return values, np.ones(len(values)), labels

    def system(self) -> LinearSystem:
        """A p − b: the residual linearised at this point (exactly, where every shape is complete
        and the matrices are linear in p)."""
        model = self.residual.model
        derivatives = model.derivatives(self.p)
        A = np.vstack(
            [
                found.projected(whitened(L, forces(derivatives, mode, found.full)))
                for mode, L, found in zip(
                    self.residual.assigned, self.residual.weights, self.modes, strict=True
                )
            ]
        )
        values, weights, labels = self.differences
        free = sum(found.basis.shape[1] for found in self.modes)
        names = tuple(q.name for q in model.parameters)
        return LinearSystem(A, A @ self.p - values, weights, names, labels, len(values) - free)
