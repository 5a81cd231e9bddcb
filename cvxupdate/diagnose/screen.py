"""The short list: how much of the residual each word at each place could explain, to first order,
beside the ordinary parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.columns import Columns, sums_of
from cvxupdate.diagnose.columns import delay_unit as delay_unit
from cvxupdate.diagnose.fit import bounds_of, prior_scales
from cvxupdate.diagnose.residual import ResponsePoint
from cvxupdate.diagnose.signals import Real
from cvxupdate.physics.effect import Effect

AT_BOUND = 1e-3  # of a bound: that near counts as on it
NOTHING = 1e-12  # of a column: what is left of it then is rounding
FAINT = 1e-3  # of its members' lengths: below, the length of a sum is not taken from their products


@dataclass(frozen=True)
class Score:
    """A candidate's share of the residual that it explains (0..1) and its size ``p``, with the side
    it may take respected.

    To first order, or ``exact``: at the best of several sizes (`cvxupdate.diagnose.sized`).
    """

    candidate: Effect
    share: float
    p: Real
    exact: bool = False


@dataclass(frozen=True)
class Left:
    """What the ordinary unknowns cannot take up of a point's residual.

    ``residual`` (rows + priors,) weighted; ``basis`` an orthonormal basis of what they can take up;
    ``rows`` those of the recordings.
    """

    residual: Real
    basis: Real
    rows: int

    def freed(self, J: Real) -> Real:
        """Weighted columns (rows, n) freed of what the ordinary unknowns can take up, (rows +
        priors, n)."""
        padded = np.vstack([J, np.zeros((len(self.residual) - self.rows, J.shape[1]))])
        return np.asarray(padded - self.basis @ (self.basis[: self.rows].T @ J))


def left_over(point: ResponsePoint, rows: NDArray[np.bool_] | None = None) -> Left:
    """`Left` at a point, of all rows or of some. Ordinary unknowns that have reached a bound take
    up nothing."""
    A, _ = point.system().weighted()
    values, weights, _ = point.differences
    r = -weights * values
    if rows is not None:
        A, r = A[rows], r[rows]
    bounds = bounds_of(point.setting)
    free = (point.p > bounds.lower + AT_BOUND * np.abs(bounds.lower)) & (
        point.p < bounds.upper - AT_BOUND * np.abs(bounds.upper)
    )
    scales = prior_scales(point.setting)[free]
    Q, _ = np.linalg.qr(np.vstack([A[:, free], np.diag(1.0 / scales)]))
    residual = np.concatenate([r, -point.p[free] / scales])
    return Left(residual - Q @ (Q.T @ residual), Q, len(r))


def screen(
    point: ResponsePoint, candidates: Sequence[Effect], left: Left | None = None
) -> list[Score]:
    """Scores in the order of ``candidates`` (``left``: `left_over` of the point where it is at
    hand).

    Residual and columns are weighted and freed of what the ordinary unknowns (with their priors)
    can take up; a candidate's share is the part of the squared residual that its own best size
    removes.
    """
    left = left_over(point) if left is None else left
    sets = sums_of(candidates)
    out = [Score(c, 0.0, np.zeros(c.count)) for c in candidates]
    kept: dict[
        int, tuple[Real, Real]
    ] = {}  # columns of single elements, as they are and freed, for the sets
    singles = {k for members in sets.values() for k in members}
    for numbers, J in Columns(point).batches(
        {k: c for k, c in enumerate(candidates) if k not in sets}
    ):
        Jp = left.freed(J)
        at = 0
        width = J.shape[1] // len(numbers)
        if width == 1:
            for k, score in zip(
                numbers,
                _scored(
                    [candidates[k] for k in numbers],
                    Jp.T @ left.residual,
                    norms(Jp),
                    norms(J),
                    left,
                ),
                strict=True,
            ):
                out[k] = score
        for k in numbers:
            if width > 1:
                out[k] = _several(
                    candidates[k], J[:, at : at + width], Jp[:, at : at + width], left
                )
            if k in singles:
                kept[k] = J[:, at], Jp[:, at]
            at += width
    _score_sets(candidates, sets, kept, left, out)
    return out


def norms(J: Real) -> Real:
    """Lengths of columns."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", J, J)))


def _scored(
    chosen: Sequence[Effect], along: Real, length: Real, whole: Real, left: Left
) -> list[Score]:
    """Scores of candidates with one column each: ``along`` the residual, ``length`` freed,
    ``whole`` before."""
    total = float(left.residual @ left.residual)
    usable = length > NOTHING * np.maximum(whole, 1e-300)
    sizes = along / np.where(usable, length, 1.0) ** 2
    usable &= ~((np.array([c.sign for c in chosen]) > 0) & (sizes < 0.0))
    return [
        Score(c, float(a * p / total) if good else 0.0, np.array([p if good else 0.0]))
        for c, a, p, good in zip(chosen, along, sizes, usable, strict=True)
    ]


def _several(c: Effect, J: Real, Jp: Real, left: Left) -> Score:
    """A candidate with several columns."""
    length = norms(Jp)
    if np.any(length <= NOTHING * np.maximum(norms(J), 1e-300)):
        return Score(c, 0.0, np.zeros(c.count))
    best, *_ = np.linalg.lstsq(Jp / length, left.residual, rcond=1e-8)
    best = best / length
    if c.sign > 0 and best[0] < 0.0:
        return Score(c, 0.0, np.zeros(len(best)))
    rest = left.residual - Jp @ best
    return Score(c, 1.0 - float(rest @ rest) / float(left.residual @ left.residual), best)


def _score_sets(
    candidates: Sequence[Effect],
    sets: Mapping[int, Sequence[int]],
    kept: Mapping[int, tuple[Real, Real]],
    left: Left,
    out: list[Score],
) -> None:
    """A set of elements moves as the sum of its members: lengths from the members' products, by the
    sum itself where little is left of it."""
    numbers = [k for k, members in sets.items() if all(m in kept for m in members)]
    if not numbers:
        return
    place = {m: i for i, m in enumerate(kept)}
    J, Jp = (np.stack([pair[i] for pair in kept.values()], axis=1) for i in (0, 1))
    member = np.zeros((len(place), len(numbers)))
    for column, k in enumerate(numbers):
        member[[place[m] for m in sets[k]], column] = 1.0
    whole, length = (
        np.sqrt(np.maximum(np.einsum("ij,ij->j", member, (X.T @ X) @ member), 0.0)) for X in (J, Jp)
    )
    faint = length <= FAINT * (norms(Jp) @ member)
    length[faint] = norms(Jp @ member[:, faint])
    along = (Jp.T @ left.residual) @ member
    for k, score in zip(
        numbers, _scored([candidates[k] for k in numbers], along, length, whole, left), strict=True
    ):
        out[k] = score
