"""What one linear system says of parameters and of groups of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cvxupdate.system import Array, LinearSystem

Groups = tuple[tuple[int, ...], ...]
"""Groups of columns, each of one row of [update] parameters."""
NOTHING = 1e-10
"""Of the largest singular value: below, a direction is not seen."""
RESOLVED = 1e-3
"""Of the mismatch: what the linear system leaves unexplained is taken for no less, because it is
but the first of several."""


@dataclass(frozen=True, eq=False)
class Seen:
    """``J`` (m, n) and ``y`` (m,): the columns of single parameters and the mismatch, in standard
    deviations, with what all other parameters explain taken out; ``scatter``: the deviation that
    the rows really have, in those deviations."""

    J: Array
    y: Array
    scatter: float

    def deviations(self, groups: Groups) -> Array:
        """Standard deviation of the p of each group, where one p stands for all its members; huge
        where the recordings leave it open."""
        A = np.stack([self.J[:, list(g)].sum(axis=1) for g in groups], axis=1)
        _, s, Vt = np.linalg.svd(A, full_matrices=False)
        if Vt.shape[0] < Vt.shape[1]:  # fewer rows than groups
            Vt = np.vstack([Vt, la.null_space(Vt).T])
            s = np.append(s, np.zeros(len(Vt) - len(s)))
        s = np.maximum(s, NOTHING * max(float(s.max(initial=0.0)), np.finfo(float).tiny))
        return np.asarray(self.scatter * np.sqrt(np.sum((Vt / s[:, None]) ** 2, axis=0)))

    def alike(self, one: Sequence[int], other: Sequence[int]) -> float:
        """Cosine of the sensitivities of two groups: 1 where no recording tells them apart."""
        a, b = self.J[:, list(one)].sum(axis=1), self.J[:, list(other)].sum(axis=1)
        size = float(np.linalg.norm(a) * np.linalg.norm(b))
        return float(a @ b) / size if size > 0.0 else 1.0


def seen(system: LinearSystem, columns: Sequence[int], relative: bool) -> Seen:
    """What ``system`` says of its ``columns``; with weights that are ``relative`` only the scatter
    is that of its residuals, else at least the stated one."""
    A, y = system.weighted()
    others = np.setdiff1d(np.arange(A.shape[1]), columns)
    if len(others):
        Q = la.orth(A[:, others])
        A, y = A - Q @ (Q.T @ A), y - Q @ (Q.T @ y)
    J = A[:, list(columns)]
    best, _, rank, _ = np.linalg.lstsq(J, y, rcond=NOTHING)
    freedom = system.count - int(rank) - len(others)
    left = float(np.sum((J @ best - y) ** 2))
    ratio = left / freedom if freedom > 0 else 1.0
    least = RESOLVED**2 * float(y @ y) / max(system.count, 1)
    if not relative:
        ratio = max(ratio, 1.0)
    # J and y in fewer rows: only products of columns count
    R = np.asarray(np.linalg.qr(np.column_stack([J, y]), mode="r"))
    return Seen(R[:, :-1], R[:, -1], float(np.sqrt(max(ratio, least, np.finfo(float).tiny))))
