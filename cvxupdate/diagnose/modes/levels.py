"""Whether tables of modes depend on the drive level."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose.modes.kinds import chi_square
from cvxupdate.diagnose.settings import ANOTHER_MODE, CHANCE, REPEATED, UNSTATED_DAMPING
from cvxupdate.diagnose.types import LevelChange, Real
from cvxupdate.recordings.types import ModeTable

TYPICAL = 0.005  # damping ratio where a table states none


def level_change(tables: Sequence[ModeTable]) -> LevelChange | None:
    """The largest change between two tables at different drive levels, as the transfer functions
    near resonance change; None where no two levels compare.

    A mode's response at resonance goes with 1 / ζ, and a shift of its frequency counts in
    half-power bandwidths: to first order the relative change is (Δf / (2 ζ f), Δ ln ζ). Every entry
    has a standard deviation (`cvxupdate.diagnose.modes.tables.Tables.measured`).
    """
    known = [t for t in tables if t.origin.level is not None]
    pairs = [(a, b) for a, b in combinations(known, 2) if a.origin.level != b.origin.level]
    changes = [_between(a, b) for a, b in pairs]
    return max((c for c in changes if c is not None), key=lambda c: c.change, default=None)


def state_change(before: Sequence[ModeTable], after: Sequence[ModeTable]) -> float:
    """The largest relative change of a frequency from one state of a structure to another; 0 where
    deviations, and what a frequency changes by from day to day, explain all."""
    shifts, squares = [0.0], 0.0
    for a in before:
        for b in after:
            i, j = _alike(a, b)
            moved = np.log(b.frequency[j] / a.frequency[i])
            std = [t.frequency_std[k] / t.frequency[k] for t, k in ((a, i), (b, j))]
            squares += float(np.sum(moved**2 / (std[0] ** 2 + std[1] ** 2 + 2.0 * REPEATED**2)))
            shifts += np.abs(moved).tolist()
    count = len(shifts) - 1
    return max(shifts) if count and squares > chi_square(CHANCE, count) else 0.0


def _alike(a: ModeTable, b: ModeTable) -> tuple[np.ndarray, np.ndarray]:
    """The modes of two tables that are one another, by frequency."""
    apart = np.abs(np.log(a.frequency[:, None] / b.frequency[None, :]))
    i, j = linear_sum_assignment(apart)
    same = apart[i, j] < ANOTHER_MODE
    return i[same], j[same]


def _between(a: ModeTable, b: ModeTable) -> LevelChange | None:
    i, j = _alike(a, b)
    if not len(i):
        return None
    zeta, ratio, spread = _damping(a, b, i, j)
    mean = 0.5 * (a.frequency[i] + b.frequency[j])
    shift = (a.frequency[i] - b.frequency[j]) / (2.0 * zeta * mean)
    shift_std = np.hypot(a.frequency_std[i], b.frequency_std[j]) / (2.0 * zeta * mean)

    def together(x: Real, y: Real) -> float:
        return float(np.sqrt(np.mean(x**2 + y**2)))

    return LevelChange(together(shift, ratio), together(shift_std, spread), "resonances")


def _damping(a: ModeTable, b: ModeTable, i: np.ndarray, j: np.ndarray) -> tuple[Real, Real, Real]:
    """Of paired modes: damping ratio, change of its logarithm, and the deviation of that; zeros
    where either table states none."""
    x, y = a.damping[i], b.damping[j]
    known = np.isfinite(x) & np.isfinite(y) & (x > 0.0) & (y > 0.0)
    x, y = np.where(known, x, TYPICAL), np.where(known, y, TYPICAL)

    def relative(std: Real, value: Real) -> Real:
        return np.where(np.isfinite(std), std / value, UNSTATED_DAMPING)

    spread = np.hypot(relative(a.damping_std[i], x), relative(b.damping_std[j], y))
    return np.sqrt(x * y), np.where(known, np.log(x / y), 0.0), np.where(known, spread, 0.0)
