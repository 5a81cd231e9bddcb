"""One pass over a long record, block by block: level, missing values, clipping, drop-outs and lines
of every channel.

What `quality.samples` and `lines` say of a whole channel is put together from its blocks, so memory
depends on the block and not on the record. Means, extremes, outermost levels, runs of equal values
and spectra are those of the whole record; the converter's step, and whether values repeat, are
those of the block that shows it best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.lines import BLOCK, Line, block_power, lines_of_power
from cvxupdate.recordings.quality.finding import ALPHA
from cvxupdate.recordings.quality.samples import (
    clipping_of,
    dropout_threshold,
    repeats,
    step_between,
)
from cvxupdate.recordings.read.contents import AnyArray, Progress
from cvxupdate.recordings.read.disk_buffer import release
from cvxupdate.recordings.types import Real

LONG = 2**20
"""Samples of a block; a record that is not longer is looked at as a whole."""

_BESIDE = 2**12  # samples beside a run of equal values that say whether the signal moves there
_LEVELS = 16


@dataclass(frozen=True)
class Survey:
    """One channel: level in the file's numbers, counts of samples at fault, dominant lines."""

    mean: float
    rms: float
    least: float
    largest: float
    missing: int
    clipped: int
    dropped: int
    lines: tuple[Line, ...]


class _Level:
    """Mean, deviation, extremes, outermost levels with their counts, converter step."""

    def __init__(self) -> None:
        self.count, self.mean, self.square, self.step, self.middle = 0, 0.0, 0.0, 0.0, 0.0
        self.low: tuple[Real, NDArray[np.int64]] = (np.zeros(0), np.zeros(0, dtype=np.int64))
        self.high = self.low

    def add(self, x: Real) -> None:
        # Chan, Golub, LeVeque (1983): means and squares of two parts joined without cancellation
        mean, total = float(np.mean(x)), self.count + x.size
        self.square += (
            float(np.sum((x - mean) ** 2)) + (mean - self.mean) ** 2 * self.count * x.size / total
        )
        self.mean += (mean - self.mean) * x.size / total
        self.count = total
        levels, counts = np.unique(x, return_counts=True)
        self.step = max(self.step, step_between(levels, x.size))
        self.middle = max(self.middle, repeats(counts))
        # a level among the outermost of the record is among the outermost from its first sample on:
        # nothing is lost
        self.low = _joined(self.low, (levels[:_LEVELS], counts[:_LEVELS]), slice(0, _LEVELS))
        self.high = _joined(
            self.high, (levels[-_LEVELS:], counts[-_LEVELS:]), slice(-_LEVELS, None)
        )

    def deviation(self) -> float:
        return float(np.sqrt(self.square / self.count))

    def clipped(self) -> int:
        if self.low[0].size < _LEVELS:
            return 0
        test = clipping_of(
            (self.low[1][:5], float(self.low[0][0])),
            (self.high[1][::-1][:5], float(self.high[0][-1])),
            self.middle,
        )
        return int(test.value) if test.fault else 0


def _joined(
    a: tuple[Real, NDArray[np.int64]], b: tuple[Real, NDArray[np.int64]], keep: slice
) -> tuple[Real, NDArray[np.int64]]:
    levels, place = np.unique(np.concatenate([a[0], b[0]]), return_inverse=True)
    counts = np.zeros(levels.size, dtype=np.int64)
    np.add.at(counts, place, np.concatenate([a[1], b[1]]))
    return levels[keep], counts[keep]


class _Runs:
    """Runs of equal values with the r.m.s. slope beside them; a run that a block ends is finished
    in the next one."""

    def __init__(self, samples: int) -> None:
        self.threshold = dropout_threshold(samples, ALPHA)
        self.found: list[Real] = []  # (runs, 2): length, least slope beside
        self.tail: Real = np.zeros(0)
        self.noted = (
            -1
        )  # last sample of the last run that is in ``found``, counted from the start of ``tail``
        self.inherited = np.nan  # slope before a run that was longer than memory should hold

    def add(self, x: Real, last: bool) -> None:
        window = np.concatenate([self.tail, x])
        slopes = np.diff(window)
        same = np.concatenate([[0], (slopes == 0.0).astype(np.int8), [0]])
        edges = np.flatnonzero(np.diff(same)).reshape(-1, 2)
        edges = edges[edges[:, 1] - edges[:, 0] + 1 > self.threshold]
        start, stop = edges[:, 0], edges[:, 1]  # first and last sample of each run
        reach = np.minimum(stop - start + 1, _BESIDE)
        power = np.concatenate([[0.0], np.cumsum(slopes**2)])
        # the jumps into and out of the run belong to the fault, not to the signal beside it
        before = _slope(power, start - 1 - reach, start - 1)
        after = _slope(power, stop + 2, stop + 1 + reach)
        if start.size and start[0] == 0 and np.isfinite(self.inherited):
            before[0] = self.inherited
        else:
            self.inherited = np.nan
        ready = np.ones(start.size, dtype=bool) if last else stop + 1 + reach < window.size
        ready &= np.cumsum(~ready) == 0  # in order: none is noted before the one ahead of it
        beside = np.fmin(before, after)
        fresh = stop > self.noted
        noted = int(stop[ready][-1]) if np.any(ready) else self.noted
        keep = max(window.size - 2 * _BESIDE, 0)
        if not np.all(ready):
            first = int(np.flatnonzero(~ready)[0])
            keep = min(keep, max(int(start[first]) - 2 - _BESIDE, 0))
            if (
                window.size - keep > 4 * LONG
            ):  # one value for millions of samples: what is known of it is noted, the rest follows
                ready[first], self.inherited, noted, keep = (
                    True,
                    float(before[first]),
                    window.size - 1,
                    window.size - 1,
                )
        self.found.append(
            np.stack([stop - start + 1.0, beside], axis=1)[ready & fresh & np.isfinite(beside)]
        )
        self.tail, self.noted = window[keep:].copy(), noted - keep

    def dropped(self, floor: float) -> int:
        runs = np.concatenate([np.zeros((0, 2)), *self.found])
        return int(np.sum(runs[runs[:, 1] > floor, 0]))


def _slope(power: Real, first: NDArray[np.int64], last: NDArray[np.int64]) -> Real:
    """Root mean square of the slopes ``first`` to ``last`` (not included) from their running sum of
    squares; NaN for fewer than two."""
    first, last = np.clip(first, 0, power.size - 1), np.clip(last, 0, power.size - 1)
    count = last - first
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(
            np.where(
                count >= 2, np.sqrt(np.maximum(power[last] - power[first], 0.0) / count), np.nan
            )
        )


class _Spectrum:
    """Mean power over blocks of `lines.BLOCK` samples."""

    def __init__(self) -> None:
        self.power: Real = np.zeros(BLOCK // 2 + 1)
        self.blocks = 0
        self.rest: Real = np.zeros(0)

    def add(self, x: Real, mean: float) -> None:
        data = np.concatenate([self.rest, x])
        full = data.size // BLOCK
        if full:  # any constant will do: lines 0 and 1, where it shows, are left out
            self.power += block_power(data[: full * BLOCK] - mean, BLOCK)
        self.blocks += full
        self.rest = data[full * BLOCK :].copy()

    def lines(self, rate: float) -> tuple[Line, ...]:
        return (
            lines_of_power(self.power / self.blocks, self.blocks, BLOCK, rate)
            if self.blocks and np.isfinite(rate)
            else ()
        )


class _Channel:
    def __init__(self, samples: int) -> None:
        self.missing, self.level, self.runs, self.spectrum = (
            0,
            _Level(),
            _Runs(samples),
            _Spectrum(),
        )

    def add(self, piece: AnyArray, last: bool) -> None:
        x: Real = np.asarray(np.abs(piece) if piece.dtype.kind == "c" else piece, dtype=np.float64)
        good = np.isfinite(x)
        self.missing += x.size - int(np.count_nonzero(good))
        x = x[good]
        if x.size:
            self.level.add(x)
            self.spectrum.add(x, self.level.mean)
        self.runs.add(x, last)

    def result(self, rate: float) -> Survey:
        level = self.level
        if not level.count:
            return Survey(*(float("nan"),) * 4, self.missing, 0, 0, ())
        deviation = level.deviation()
        moves = level.low[0].size >= _LEVELS  # a switched signal, or a dead channel, has no slopes
        dropped = self.runs.dropped(max(5.0 * level.step, 1e-3 * deviation)) if moves else 0
        lines = self.spectrum.lines(rate) if deviation > 0.0 else ()
        return Survey(
            level.mean,
            deviation,
            float(level.low[0][0]),
            float(level.high[0][-1]),
            self.missing,
            level.clipped(),
            dropped,
            lines,
        )


def survey(
    columns: Sequence[AnyArray], rate: float, progress: Progress | None = None, what: str = ""
) -> tuple[Survey, ...]:
    """Every channel of a record in one pass, `LONG` samples at a time; ``columns`` are equally
    long, and may lie on disk.

    ``progress(what, samples done, samples in all)`` is called after each block.
    """
    samples = len(columns[0]) if columns else 0
    channels = [_Channel(samples) for _ in columns]
    for at in range(0, samples, LONG):
        for channel, column in zip(channels, columns, strict=True):
            channel.add(column[at : at + LONG], at + LONG >= samples)
        release(*columns)
        if progress is not None:
            progress(what, min(at + LONG, samples), samples)
    return tuple(channel.result(rate) for channel in channels)
