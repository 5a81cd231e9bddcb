"""The modal comparison of a small model that stands for the large one near points already known.

Rayleigh–Ritz in the span of modes and derivatives of shapes that were found at those points. At the
last of them the small model says what the large one says, rows and their derivatives alike, so its
steps may go where one linearisation would not do (reduced bases with derivatives: Noor and Lowder
1974; Balmès 1996; managed by a trust region: Alexandrov et al. 1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dsyevd

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.derivatives import Stack
from cvxupdate.residual.modal_point import ModalPoint, ModalResidual
from cvxupdate.residual.repeated import REPEATED
from cvxupdate.residual.shape_forms import FORMS
from cvxupdate.system import Array, LinearSystem

INDEPENDENT = 1e-12  # relative eigenvalue of a Gram matrix below which a direction is rounding


@dataclass(frozen=True)
class ReducedModal:
    """``basis`` V (N, m) with VᵀMV = I, the large ``matrices`` at ``p`` (n,), the reduced
    ``stiffness`` (m, m) there and its derivatives ``parts`` (n, m, m), the same everywhere. Farther
    than ``reach`` from ``p`` in units of ``unit`` (n,) it is not asked."""

    residual: ModalResidual
    matrices: Matrices
    p: Array
    basis: Real
    stiffness: Real
    parts: Real
    reach: float
    unit: Array

    def evaluate(self, p: Array, before: ReducedPoint | None = None) -> ReducedPoint:
        """The comparison at ``p`` (n,), each measured mode followed from ``before`` (None: from
        the residual's start).

        Raises
        ------
        ModelError
            Where the small model is no structure, or out of reach.
        """
        p = np.asarray(p, dtype=float)
        if np.max(np.abs(p - self.p) / self.unit, initial=0.0) > self.reach:
            raise ModelError("the small model is not trusted so far from the points it knows.")
        change = np.tensordot(p - self.p, self.parts, axes=1)
        values, turn, _ = dsyevd(self.stiffness + change)
        if values[0] <= 0.0:
            raise ModelError("the stiffness matrix is not positive definite.")
        count = self.residual.count
        modes = Modes(values[:count], self.basis @ turn[:, :count], 0)
        first = self.residual.start if before is None else before.point
        point = self.residual.paired_at(p, self.matrices, modes, first.modes, first.places)
        return ReducedPoint(self, point, values, turn)


@dataclass(frozen=True)
class ReducedPoint:
    """The comparison at one parameter vector: all eigenvalues ``values`` (m,) of the small model
    and its modes ``turn`` (m, m) in the basis."""

    reduced: ReducedModal
    point: ModalPoint
    values: Real
    turn: Real

    @property
    def p(self) -> Array:
        """Parameter values (n,)."""
        return self.point.p

    @property
    def differences(self) -> tuple[Array, Array, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows."""
        return self.point.differences

    def system(self) -> LinearSystem:
        """The rows linearised at ``p``: derivatives of shapes by all modes of the small model (Fox
        and Kapoor 1968)."""
        r, paired = self.reduced.residual, self.point.paired.tolist()
        lam, turn, form = self.values, self.turn, FORMS[r.form]
        moved = {i: turn.T @ (self.reduced.parts @ turn[:, i]).T for i in set(paired)}
        rows = [np.array([moved[i][i] for i in paired])]
        for s in self.point.compared_shapes() if r.shapes else ():
            gap = lam[s.place] - lam
            apart = np.abs(gap) > REPEATED * lam[s.place]
            share = np.where(apart, 1.0 / np.where(apart, gap, 1.0), 0.0)
            seen = self.reduced.basis[s.sensors] @ turn
            d = seen @ (share[:, None] * moved[s.place])
            rows.append(form.derivative(seen[:, s.place], s.measured, s.std) @ d)
        A, (values, weights, labels) = np.vstack(rows), self.differences
        columns = tuple(q.name for q in r.model.parameters)
        return LinearSystem(A, A @ self.p - values, weights, columns, labels)


def reduced_modal(
    here: ModalPoint, known: Sequence[Real], reach: float, unit: Array
) -> ReducedModal | None:
    """The small model of ``here`` in the span of ``known``, each (N, k), trusted within ``reach``
    of it; None where it cannot follow the large one: parameters that are no factors of
    stiffnesses, rows whose errors are correlated."""
    r = here.residual
    if not r.reducible or here.joints:
        return None
    derivatives = r.derivatives(here.p)
    if derivatives.stack is None:
        return None
    M = here.matrices.M.copy()
    M.eliminate_zeros()  # K and M share a pattern, and M may be far emptier
    V = _orthonormal(np.hstack(known), M)
    K = V.T @ (here.matrices.K @ V)
    parts = _reduced(derivatives.stack["K"], derivatives.count, V)
    return ReducedModal(
        r, replace(here.matrices, M=M), here.p, V, (K + K.T) / 2.0, parts, reach, unit
    )


def _orthonormal(X: Real, M: sp.csc_array) -> Real:
    """What the columns of X span, VᵀMV = I: twice, for rounding of the first is as large as the
    directions that it tells apart are small."""
    for _ in range(2):
        gram = X.T @ (M @ X)
        scale = 1.0 / np.sqrt(gram.diagonal())
        weights, V, _ = dsyevd(gram * scale * scale[:, None])
        keep = weights > INDEPENDENT * weights[-1]
        X = X @ (scale[:, None] * (V[:, keep] / np.sqrt(weights[keep])))
    return X


def _reduced(stack: Stack, count: int, V: Real) -> Real:
    """Vᵀ ∂K/∂p_j V, (count, m, m)."""
    pushed = stack.rows @ V
    out = np.zeros((count, V.shape[1], V.shape[1]))
    ends = np.searchsorted(stack.parameter, np.arange(count + 1))
    for j in range(count):
        at = slice(ends[j], ends[j + 1])
        out[j] = V[stack.dof[at]].T @ pushed[at]
    return np.asarray((out + out.transpose(0, 2, 1)) / 2.0)
