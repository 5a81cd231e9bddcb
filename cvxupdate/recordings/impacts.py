"""Records of a hammer: told by their force, cut into blows, and made into frequency responses.

D. J. Ewins, *Modal Testing* (2000), section 3.7: the structure is at rest before each blow, so no
block needs a Hann window; the force is its pulse and nothing else, and an exponential window is
known exactly (`cvxupdate.recordings.windows.without_decay`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.channels import split_channels
from cvxupdate.recordings.spectral import frf_from_impacts
from cvxupdate.recordings.types import FrequencyResponse, Real, TimeHistory

LOUD = 0.05
"""Of the largest force: below it a sample is no part of a blow; noise is a tenth of it."""
SELDOM = 0.03
"""Fraction of the samples that are loud in a record of blows. Of random forces 80 % are, of a sine
97 %, and a burst this short is a blow for all that follows."""
PULSE = 0.2
"""Of the largest force: where a blow counts as one."""
REST = 0.25
"""Of the longest pause: a shorter one is within a blow (the hammer rebounds)."""
TAIL = 1e-3
"""What a block's end should be of its peak; an exponential window does what is missing."""
MOST_DECAY = 7.0
"""Of δT: a stronger window leaves nothing of the response."""
LEAD = 8
"""Samples before a blow that are kept where there are so many."""
SKIRT = 3.0
"""Widths of a pulse beside it that are still force: the filter's ringing."""


@dataclass(frozen=True)
class Blows:
    """``starts`` (blows,) first samples of blocks of ``block`` samples; ``pulse`` (samples,) True
    where the force acts; ``decay`` in 1/s of the window that the responses need; ``rebounds`` how
    many pulses stand within a block beside its first."""

    starts: NDArray[np.int64]
    block: int
    pulse: NDArray[np.bool_]
    decay: float
    rebounds: int


def struck(history: TimeHistory) -> bool:
    """Whether the one force of a record is a series of blows."""
    forces = [k for k, c in enumerate(history.channels) if c.quantity == "force"]
    if len(forces) != 1 or len(history.data) < 64:
        return False
    force = _without_offset(history.data[:, forces[0]])
    top = float(np.max(np.abs(force)))
    return bool(top > 0.0 and np.mean(np.abs(force) > LOUD * top) < SELDOM)


def _without_offset(force: Real) -> Real:
    """A hammer is at rest nearly always: its median is the amplifier's offset."""
    return np.asarray(force - np.median(force), dtype=np.float64)


def blows_of(force: Real, responses: Real, rate: float) -> Blows:
    """The blows of a record: ``force`` (samples,) without offset, ``responses`` (samples,
    channels).

    Blows nearer to each other than a quarter of the longest pause are one (a rebound). Every block
    is as long as the shortest pause between two of them, or as what follows the last one.
    """
    n, size = len(force), np.abs(force)
    loud = np.flatnonzero(size > PULSE * size.max())
    first = loud[np.flatnonzero(np.diff(loud, prepend=-n) > 1)]
    pauses = np.diff(np.append(first, n))
    begins = first[np.concatenate([[True], pauses[:-1] >= REST * pauses.max()])]
    if len(begins) > 1 and n - begins[-1] < REST * np.diff(begins).max():
        begins = begins[:-1]  # a blow that the record cuts short
    lead = int(min(LEAD, begins[0]))
    block = int(np.diff(np.append(begins, n + lead)).min())
    starts = np.asarray(begins - lead, dtype=np.int64)
    tail = [responses[s + block - max(block // 10, 1) : s + block] for s in starts]
    ends = np.sqrt(np.mean([np.var(t, axis=0) for t in tail], axis=0))
    peaks = np.max(np.abs(responses - np.median(responses, axis=0)), axis=0)
    left = float(np.max(ends / np.where(peaks > 0.0, peaks, np.inf)))
    decay = float(np.clip(np.log(max(left, 1e-300) / TAIL), 0.0, MOST_DECAY)) * rate / block
    inside = (first[:, None] >= starts) & (first[:, None] < starts + block)
    rebounds = int(np.count_nonzero(inside)) - len(starts)
    return Blows(starts, block, _pulses(size), decay, rebounds)


def _pulses(size: Real) -> NDArray[np.bool_]:
    """Where |force| is a pulse: above `LOUD`, and `SKIRT` widths of it on either side."""
    loud = size > LOUD * size.max()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], loud, [False]]).astype(np.int8)))
    acts = np.zeros(len(size), dtype=bool)
    for begin, end in edges.reshape(-1, 2):
        beside = int(np.ceil(SKIRT * (end - begin)))
        acts[max(0, begin - beside) : end + beside] = True
    return acts


def reached(force: Real, rate: float) -> float:
    """The highest frequency (Hz) at which the blows still have a tenth of their largest spectrum,
    at most 0.45 of the rate: above it responses over forces are noise."""
    f = np.fft.rfftfreq(len(force), 1.0 / rate)
    power = np.abs(np.fft.rfft(force)) ** 2
    wide = max(3, len(power) // 100)
    smooth = np.sqrt(np.convolve(power, np.ones(wide) / wide, mode="same"))
    low = np.flatnonzero(smooth < 0.1 * smooth.max())
    after = low[low > int(np.argmax(smooth))]
    return float(min(f[after[0]] if len(after) else f[-1], 0.45 * rate))


def frf_from_blows(
    history: TimeHistory, quantity: str | None = None
) -> tuple[FrequencyResponse, Blows, float]:
    """FRFs of a record of blows, how it was cut, and the highest frequency (Hz) that they reached.

    Give ``identify_modes(added_decay=blows.decay)``. With one blow there is no variance.

    Raises
    ------
    RecordingError
        When samples are not finite, there is not exactly one force, or no complete blow.
    """
    inputs, outputs, kind = split_channels(history.channels, quantity)
    data = np.array(history.data[:, [*inputs, *outputs]], dtype=np.float64)
    if not np.all(np.isfinite(data)):
        raise RecordingError(
            f"{history.origin.name}: NaN or infinite samples; repair them or cut the record first"
        )
    data[:, 0] = _without_offset(data[:, 0])
    blows = blows_of(data[:, 0], data[:, 1:], history.rate)
    data[~blows.pulse, 0] = 0.0
    for start in blows.starts:
        # at the end the structure is at rest: what its sensors still show there is their offset
        block = data[start : start + blows.block, 1:]
        block -= block[len(block) // 2 :].mean(axis=0)
    channels = tuple(history.channels[k] for k in (*inputs, *outputs))
    lead = int(np.flatnonzero(np.abs(data[:, 0]) > PULSE * np.abs(data[:, 0]).max())[0])
    frf = frf_from_impacts(
        replace(history, channels=channels, data=data),
        block=blows.block,
        pretrigger=lead - int(blows.starts[0]),
        threshold=PULSE,
        decay=blows.decay,
        quantity=kind,
    )
    return frf, blows, reached(data[:, 0], history.rate)
