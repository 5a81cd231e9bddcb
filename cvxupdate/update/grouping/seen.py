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
linear only near where it was taken."""
OVERSTATED = 5.0
"""Deviations of χ² below its mean by which it is less than chance: the stated ones are too large
(estimates from the roughness of few lines are)."""
INVISIBLE = 1e-6
"""Of a direction: what may stand out from those that change no matrix."""


@dataclass(frozen=True, eq=False)
class Seen:
    """``J`` (m, n) and ``y`` (m,): the columns of single parameters and the mismatch, in standard
    deviations, with what all other parameters explain taken out; ``scatter``: the deviation that
    the rows really have, in those deviations. ``silent`` (n, k): an orthonormal basis of the
    changes that no recording of any kind can see."""

    J: Array
    y: Array
    scatter: float
    silent: Array

    def deviations(self, groups: Groups) -> Array:
        """Standard deviation of the p of each group, where one p stands for all its members; huge
        where the recordings leave it open.

        That of the shortest solution where a direction is ``silent``: no grouping and no recording
        mends that, and it is said of the model.
        """
        member = np.zeros((self.J.shape[1], len(groups)))
        for k, group in enumerate(groups):
            member[list(group), k] = 1.0
        # gesdd fails to converge on some of these
        _, s, Vt = la.svd(self.J @ member, full_matrices=True, lapack_driver="gesvd")
        s = np.append(s, np.zeros(len(Vt) - len(s)))
        floor = NOTHING * max(float(s.max(initial=0.0)), np.finfo(float).tiny)
        null = Vt[s <= floor]
        if len(null) and self.silent.shape[1]:
            moved = member @ null.T
            size = np.linalg.norm(moved, axis=0, keepdims=True)
            beside = (moved - self.silent @ (self.silent.T @ moved)) / size
            _, out, turn = la.svd(beside, lapack_driver="gesvd")
            out = np.append(out, np.zeros(len(turn) - len(out)))
            null = (turn @ (null / size.T))[out > INVISIBLE]
        told = Vt[s > floor] / s[s > floor][:, None]
        return np.asarray(
            self.scatter * np.sqrt(np.sum(told**2, axis=0) + np.sum((null / floor) ** 2, axis=0))
        )

    def alike(self, one: Sequence[int], other: Sequence[int]) -> float:
        """Cosine of the sensitivities of two groups: 1 where no recording tells them apart."""
        a, b = self.J[:, list(one)].sum(axis=1), self.J[:, list(other)].sum(axis=1)
        size = float(np.linalg.norm(a) * np.linalg.norm(b))
        return float(a @ b) / size if size > 0.0 else 1.0


def seen(
    system: LinearSystem,
    columns: Sequence[int],
    relative: bool,
    at: Array | None = None,
    factors: Sequence[bool] = (),
    silent: Sequence[Array] = (),
) -> Seen:
    """What ``system`` says of its ``columns``; with weights that are ``relative`` only the scatter
    is that of its residuals, else the stated one, or the residuals' where chance forbids it.

    Linearised ``at`` p (n,; None: 0). Those that are ``factors`` 1 + p (n of them, empty: none) are
    counted by their logarithms, in which products such as E h³ are linear, and the ``silent``
    directions (n,) of p, which trade one factor for another, are the same at every p.
    """
    A, b = system.weighted()
    p = np.zeros(A.shape[1]) if at is None else at
    slope, value = np.ones(len(p)), p.copy()
    if len(factors):
        logs = np.array(factors) & (p > -1.0)
        slope[logs], value[logs] = 1.0 + p[logs], np.log1p(p[logs])
    y = b - A @ p + A @ (slope * value)
    A = A * slope
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
    if not relative and ratio > 1.0 - OVERSTATED * np.sqrt(2.0 / max(freedom, 1)):
        ratio = max(ratio, 1.0)
    # J and y in fewer rows: only products of columns count
    R = np.asarray(np.linalg.qr(np.column_stack([J, y]), mode="r"))
    none = np.zeros((len(columns), 0))
    hidden = [(d / slope)[list(columns)] for d in silent]
    basis = la.orth(np.stack(hidden, axis=1)) if hidden else none
    scatter = float(np.sqrt(max(ratio, least, np.finfo(float).tiny)))
    return Seen(R[:, :-1], R[:, -1], scatter, basis)
