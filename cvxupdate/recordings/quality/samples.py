"""Faults of one channel, sample by sample: missing values, clipping, drop-outs, drift. Pure
functions of an array."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.quality.finding import ALPHA
from cvxupdate.recordings.quantiles import binomial_reaches, fisher_two_above
from cvxupdate.recordings.types import Real


@dataclass(frozen=True)
class Test:
    """A test's outcome: ``statistic`` against ``threshold`` (a fault when it is larger), and the
    size of the fault."""

    statistic: float
    threshold: float
    value: float
    where: int = -1

    @property
    def fault(self) -> bool:
        """Whether the threshold is crossed."""
        return self.statistic > self.threshold


def step_of(x: Real) -> float:
    """The step of an analogue-to-digital converter, 0 when the values do not repeat enough to show
    one."""
    return step_between(np.unique(x), x.size)


def step_between(levels: Real, size: int) -> float:
    """`step_of` from the distinct values, in rising order, of ``size`` samples."""
    if len(levels) < 3 or size < 1.05 * len(levels):
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * (levels[-1] - levels[0])]
    return float(np.quantile(gaps, 0.05)) if gaps.size else 0.0


def missing(x: Real) -> int:
    """Number of values that are NaN or infinite."""
    return int(np.count_nonzero(~np.isfinite(x)))


def clipping(x: Real, alpha: float = ALPHA) -> Test:
    """Samples piled up at the largest or smallest value.

    Without repeated values elsewhere, three equal extremes have probability zero. With a
    converter's steps, the law that piles up most at its edge among those of vibration is the
    sine's: of the samples on the five outermost levels at most 44.7 % are on the last one (√1 :
    √2-√1 : …), so their number is compared with a binomial. An extreme of exactly 0 is a rest, not
    a limit, and fewer than 16 levels (a switched signal) have no tails to compare. ``value`` is the
    number of samples at the extremes.
    """
    levels, counts = np.unique(x, return_counts=True)
    if len(levels) < 16:
        return Test(0.0, 1.0, 0.0)
    return clipping_of(
        (counts[:5], float(levels[0])),
        (counts[::-1][:5], float(levels[-1])),
        repeats(counts),
        alpha,
    )


def repeats(counts: NDArray[np.int64]) -> float:
    """How often a value occurs, on the average over the levels that are not outermost (at least one
    level)."""
    return float(np.mean(counts[5:-5]) if len(counts) > 20 else np.mean(counts))


def clipping_of(
    low: tuple[NDArray[np.int64], float],
    high: tuple[NDArray[np.int64], float],
    middle: float,
    alpha: float = ALPHA,
) -> Test:
    """`clipping` from what is needed of a record: for either end the counts of its five outermost
    levels, outermost first, and the extreme."""
    worst, value = 0.0, 0
    for outer, edge in (low, high):
        if edge == 0.0 or outer[0] < 3:
            continue
        if middle < 1.01:  # values do not repeat
            p = 1e-12 if np.all(outer[1:] == 1) or outer[0] > 3 * outer[1:].max() else 1.0
        else:
            p = binomial_reaches(int(outer[0]), int(outer.sum()), 0.4473)
        p = min(2.0 * p, 1.0)
        if -np.log10(max(p, 1e-300)) > worst:
            worst = -np.log10(max(p, 1e-300))
        if p < alpha:
            value += int(outer[0])
    return Test(worst, -np.log10(alpha), float(value))


def dropouts(x: Real, alpha: float = ALPHA) -> Test:
    """The longest run of equal values amid a signal that moves.

    Where the steps beside the run are larger than five converter steps (r.m.s. over as many samples
    as the run has), the next value equals the last one with a probability below 0.08, so a run
    longer than log(alpha / n) / log(0.08) is no chance. A value that more than half of the samples
    have is where the channel rests: a hammer's force between its blows. ``value`` is the number of
    samples in all such runs, ``where`` the first of the longest.
    """
    n, rest = len(x), np.median(x)
    at_rest = np.count_nonzero(x == rest) > n / 2
    if (
        n < 16 or len(np.unique(x[: 1 << 16])) < 16
    ):  # a switched signal, or a dead channel, has no slopes
        return Test(0.0, 1.0, 0.0)
    threshold = dropout_threshold(n, alpha)
    quantum = step_of(x)
    same = np.concatenate([[0], (np.diff(x) == 0.0).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(same)).reshape(-1, 2)
    longest, total, where = 0.0, 0, -1
    with np.errstate(over="ignore"):  # a flipped bit may read 1e300
        spread = float(np.std(x))
    floor = max(5.0 * quantum, 1e-3 * spread)
    for a, b in edges[(edges[:, 1] - edges[:, 0] + 1) > threshold]:
        if at_rest and x[a] == rest:
            continue
        length = int(b - a + 1)
        # the jumps into and out of the run belong to the fault, not to the signal beside it
        before, after = np.diff(x[max(0, a - 1 - length) : a]), np.diff(x[b + 2 : b + 2 + length])
        beside = [np.sqrt(np.mean(part**2)) for part in (before, after) if part.size >= 2]
        if beside and min(beside) > floor:
            total += length
            if length > longest:
                longest, where = float(length), int(a)
    return Test(longest, threshold, float(total), where)


def dropout_threshold(samples: int, alpha: float) -> float:
    """Length of a run of equal values that no chance makes in a record of so many samples."""
    return max(4.0, float(np.ceil(np.log(alpha / max(samples, 1)) / np.log(0.08))))


def drift(x: Real, alpha: float = ALPHA) -> Test:
    """A trend across the record: F test of a straight line and a parabola through the means of 24
    blocks.

    Blocks longer than the memory of the vibration have independent means, so the test is exact for
    them; the trend must also exceed a twentieth of the r.m.s., because a longer record shows
    smaller ones. ``value`` is the trend's peak-to-peak in units of the signal.
    """
    count = 24
    size = len(x) // count
    if size < 8:
        return Test(0.0, 1.0, 0.0)
    means = x[: size * count].reshape(count, size).mean(axis=1)
    t = np.linspace(-1.0, 1.0, count)
    basis = np.stack([np.ones(count), t, t**2], axis=1)
    fitted = basis @ np.linalg.lstsq(basis, means, rcond=None)[0]
    left = float(np.sum((means - fitted) ** 2))
    gained = float(np.sum((fitted - means.mean()) ** 2))
    F = (gained / 2.0) / max(left / (count - 3), np.finfo(float).tiny)
    size_of_trend = float(np.ptp(fitted))
    rest = means - fitted
    slow = float(np.sum(np.diff(rest) ** 2)) < max(
        left, np.finfo(float).tiny
    )  # von Neumann's ratio below 1: the means are not independent
    if slow and np.ptp(rest) > 0.25 * size_of_trend:
        return Test(0.0, 1.0, 0.0)  # a vibration slower than the record is no drift
    threshold = fisher_two_above(alpha, count - 3)
    return Test(F if size_of_trend > 0.05 * float(np.std(x)) else 0.0, threshold, size_of_trend)


def offset(x: Real) -> float:
    """Mean over r.m.s. about the mean: how far the record lies off zero."""
    deviation = float(np.std(x))
    return float(np.mean(x)) / deviation if deviation > 0.0 else 0.0
