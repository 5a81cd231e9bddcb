"""Quality checks: what is wrong with a recording, each with a statistic, its threshold
and a false-alarm rate.

`check` looks at one recording, `compare` at several of one structure. The checks are in the
explicit lists below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from cvxupdate.recordings.quality import between, frf, samples, timing
from cvxupdate.recordings.quality.compare import compare, compare_series
from cvxupdate.recordings.quality.finding import ALPHA, Finding
from cvxupdate.recordings.types import FrequencyResponse, Real, Recording, TimeHistory

__all__ = ["ALPHA", "Finding", "check", "compare", "compare_series"]


def _samples(history: TimeHistory) -> tuple[Finding, ...]:
    """Missing values, clipping, drop-outs and drift of every channel."""
    found: list[Finding] = []
    for column in range(len(history.channels)):
        who = between.name(history, column)
        x = history.data[:, column]
        bad = samples.missing(x)
        if bad:
            first = int(np.flatnonzero(~np.isfinite(x))[0])
            says = (
                f"{who} has {bad} values that are not numbers, the first at "
                f"{first / history.rate:.4g} s. Cut the record, or repair them."
            )
            found.append(Finding("missing values", who, says, float(bad), 0.0, float(bad)))
            x = x[np.isfinite(x)]
        if x.size >= 16 and np.ptp(x) > 0.0:
            found += _of_samples(x, who, history.rate)
    return tuple(found)


def _of_samples(x: Real, who: str, rate: float) -> Iterator[Finding]:
    """Clipping, drop-outs and drift of one channel of finite samples."""
    clip, drop, drift = samples.clipping(x), samples.dropouts(x), samples.drift(x)
    for check, test, says in (
        (
            "clipping",
            clip,
            f"{who} is clipped: {clip.value:.0f} samples sit at its extreme values "
            f"({x.min():.4g}, {x.max():.4g}). Increase the range and measure again.",
        ),
        (
            "drop-out",
            drop,
            f"{who} drops out: {drop.value:.0f} samples hold one value amid motion, "
            f"{drop.statistic:.0f} in a row at {drop.where / rate:.4g} s. Cut the record there.",
        ),
        (
            "drift",
            drift,
            f"{who} drifts by {drift.value:.3g} over the record "
            f"({100 * drift.value / np.std(x):.0f} % of its r.m.s.). Remove the trend, or let "
            "the amplifier warm up.",
        ),
    ):
        if test.fault:
            yield Finding(check, who, says, test.statistic, test.threshold, test.value)


def _finite(recording: FrequencyResponse) -> tuple[Finding, ...]:
    """FRFs with values that are not numbers."""
    found = []
    for column, channel in enumerate(recording.responses):
        bad = int(np.count_nonzero(~np.isfinite(recording.H[:, column])))
        if bad:
            found.append(
                Finding(
                    "missing values",
                    channel.label,
                    f"{channel.label} has {bad} lines that are not numbers. Leave them out (band).",
                    float(bad),
                    0.0,
                    float(bad),
                )
            )
    return tuple(found)


TIME: tuple[Callable[[TimeHistory], tuple[Finding, ...]], ...] = (
    _samples,
    between.dead,
    between.duplicates,
    between.unrelated,
)
"""Checks of a time history."""

FRF: tuple[Callable[[FrequencyResponse], tuple[Finding, ...]], ...] = (
    frf.reciprocity,
    frf.drive_points,
    frf.passivity,
    timing.delays,
    frf.coherence,
    timing.causality,
    frf.dropouts,
)
"""Checks of FRFs."""


def check(recording: Recording) -> tuple[Finding, ...]:
    """Everything suspicious in one recording, as sentences; () when nothing is.

    Every check raises a false alarm on a clean channel (or pair) with a probability of at most
    `ALPHA` (1e-3); the docstring of each says under which law. A table of modes has nothing to
    check here.
    """
    if isinstance(recording, TimeHistory):
        return tuple(finding for one in TIME for finding in one(recording))
    if isinstance(recording, FrequencyResponse):
        broken = _finite(recording)
        return broken or tuple(finding for one in FRF for finding in one(recording))
    return ()
