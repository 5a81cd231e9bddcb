"""The time axis of a record: columns that increase, sampling rates stated or derived."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray
from cvxupdate.recordings.read.disk_buffer import release
from cvxupdate.recordings.types import Real

BLOCK = 2**20
"""Samples handled together."""


def _pieces(column: AnyArray) -> Callable[[], Iterator[tuple[int, Real]]]:
    """A column as (place, numbers) of some megabytes, as often as it is asked for: it may lie on
    disk."""

    def pieces() -> Iterator[tuple[int, Real]]:
        for at in range(0, column.size, BLOCK):
            yield at, np.asarray(np.real(column[at : at + BLOCK]), dtype=float)
            release(column)

    return pieces


def rises(column: AnyArray) -> bool:
    """Whether every number is finite and larger than the one before, as times and frequencies
    are."""
    before = -np.inf
    for _, piece in _pieces(column)():
        if not (np.all(np.isfinite(piece)) and piece[0] > before and np.all(np.diff(piece) > 0.0)):
            return False
        before = float(piece[-1])
    return True


def rate_of_times(times: AnyArray, where: str) -> float:
    """Sampling rate from a column of times, (n - 1) / (last - first): printed times are rounded,
    their span hardly.

    Raises `RecordingError` when a time is off its even place by more than a quarter of a step: the
    record has a gap, or was not sampled evenly.
    """
    pieces = _pieces(times)
    if times.size < 2 or not all(np.all(np.isfinite(piece)) for _, piece in pieces()):
        raise RecordingError(
            f"{where}: the column of times has missing values. Give rate in the "
            "[[recordings]] block."
        )
    first, last = float(np.real(times[0])), float(np.real(times[-1]))
    step = (last - first) / (times.size - 1)
    if not step > 0.0:
        raise RecordingError(
            f"{where}: the times do not increase. Give the right time_column, or rate."
        )
    for at, piece in pieces():
        off = np.abs(piece - (first + step * np.arange(at, at + piece.size)))
        if off.max() > 0.25 * step:
            worst = int(np.argmax(off))
            raise RecordingError(
                f"{where}: the samples are not evenly spaced: sample {at + worst} is "
                f"{off[worst]:.3g} s off its place, with a step of {step:.3g} s. Resample it, "
                "or give rate if the times are wrong."
            )
    return float(1.0 / step)


def sampling_rate(given: float | None, stated: float | None, where: str) -> float:
    """The rate in Hz that the problem file gives or the file states; they must agree within
    0.2 %."""
    if given is None and stated is None:
        raise RecordingError(
            f"{where}: the file does not state its sampling rate. Give rate (Hz) or time_column."
        )
    if given is not None and stated is not None and abs(given - stated) > 2e-3 * stated:
        raise RecordingError(
            f"{where}: the problem file gives rate = {given:g} Hz, but the file itself states "
            f"{stated:g} Hz. Correct one of them."
        )
    rate = given if given is not None else stated
    if rate is None or not np.isfinite(rate) or rate <= 0.0:
        raise RecordingError(
            f"{where}: the sampling rate {rate} Hz is not a positive number. Give rate."
        )
    return float(rate)
