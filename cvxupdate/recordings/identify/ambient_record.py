"""From a record of responses to its correlations and their Hankel matrix."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.signal

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import MOTIONS, Real, TimeHistory

OVERSAMPLED = 1.3
"""Nyquist frequency over the band's upper end after decimation: the filter's own slope."""
LARGEST = 600
"""Rows of the Hankel matrix at most."""
PIECES = (4, 30)
"""Pieces of the record: fewer give no scatter, more are too short for the slowest mode."""
ABOVE = 2.0
"""Largest singular value of the Hankel matrix over the norm that scatter alone gives it: that of
white noise is 1 within some tens of per cent."""


def motion_columns(history: TimeHistory, quantity: str | None) -> list[int]:
    """The channels of one quantity of motion: the given one, or the one that most of them have."""
    kinds = [c.quantity for c in history.channels if c.quantity in MOTIONS]
    # poles ask for no unit: strain gauges and uncalibrated sensors tell them as well
    kinds = kinds or [c.quantity for c in history.channels if c.quantity != "force"]
    if not kinds:
        raise RecordingError(f"{history.origin.name}: no channel but forces")
    wanted = quantity if quantity is not None else max(dict.fromkeys(kinds), key=kinds.count)
    return [k for k, c in enumerate(history.channels) if c.quantity == wanted]


def scaled(y: Real, history: TimeHistory, columns: list[int]) -> tuple[Real, Real]:
    """Channels of unit power, and what they were divided by."""
    scale = np.std(y, axis=0)
    if not np.all(scale > 0.0):
        dead = [history.channels[k].label for k, s in zip(columns, scale, strict=True) if s == 0.0]
        raise RecordingError(
            f"{history.origin.name}: {', '.join(dead)} does not move; leave it out"
        )
    return y / scale, np.asarray(scale)


def must_stand_out(largest: float, beside: Real, rows: int, name: str) -> None:
    """Raise where the Hankel matrix is no larger than its own scatter makes it."""
    scatter = [_largest(block_hankel(piece, rows)) for piece in beside]
    if largest < ABOVE * float(np.mean(scatter)) / np.sqrt(len(beside)):
        raise RecordingError(
            f"{name}: the responses' correlations do not stand above their scatter from piece to "
            "piece: noise, or far too short a record"
        )


def _largest(H: Real) -> float:
    """The largest singular value, in half the time of finding all of them."""
    last = [len(H) - 1] * 2
    square = scipy.linalg.eigh(H @ H.T, eigvals_only=True, subset_by_index=last)
    return float(np.sqrt(max(square[0], 0.0)))


def decimated(history: TimeHistory, columns: list[int], high: float) -> tuple[Real, float]:
    """The channels without trend, filtered and thinned to what the band needs (zero phase)."""
    if high >= 0.5 * history.rate:
        raise RecordingError(
            f"{history.origin.name}: the band ends at {high:g} Hz, but {history.rate:g} samples a "
            f"second show nothing above {0.5 * history.rate:g} Hz"
        )
    data = np.asarray(history.data[:, columns], dtype=np.float64)
    if not np.all(np.isfinite(data)):
        raise RecordingError(
            f"{history.origin.name}: holds samples that are no numbers; cut the record "
            "(start, stop)"
        )
    y = scipy.signal.detrend(data, axis=0)
    rate, factor = history.rate, int(history.rate / (2.0 * OVERSAMPLED * high))
    while factor > 1:  # in stages: a filter of a large factor is ill-conditioned
        now = min(factor, 8)
        y = scipy.signal.decimate(y, now, ftype="fir", axis=0, zero_phase=True)
        rate, factor = rate / now, factor // now
    return np.asarray(y), rate


def block_rows(rate: float, low: float, channels: int, order: int, samples: int) -> int:
    """Block rows: two periods of the lowest frequency, enough for the order, not too many."""
    wanted = max(int(np.ceil(2.0 * rate / low)), -(-2 * order // channels), 4)
    rows = min(wanted, max(LARGEST // channels, -(-order // channels) + 2))
    if 8 * rows * PIECES[0] > samples:
        rows = max(samples // (8 * PIECES[0]), 4)
    if (rows - 1) * channels < 4 or samples < 8 * PIECES[0] * rows:
        raise RecordingError(
            f"{samples} samples (after decimation) are too few for a subspace identification; "
            "record longer, or raise the band's upper end"
        )
    return rows


def correlations(y: Real, lags: int) -> Real:
    """Correlations (pieces, lags + 1, channels, channels) of equal pieces of the record."""
    pieces = int(np.clip(len(y) // (4 * lags), *PIECES))
    length = len(y) // pieces
    n = int(2 ** np.ceil(np.log2(length + lags)))
    out = []
    for k in range(pieces):
        Y = np.fft.rfft(y[k * length : (k + 1) * length], n, axis=0)
        r = np.fft.irfft(Y[:, :, None] * np.conj(Y[:, None, :]), n, axis=0)[: lags + 1]
        out.append(r / (length - np.arange(lags + 1))[:, None, None])
    return np.array(out)


def block_hankel(R: Real, rows: int) -> Real:
    """Blocks R[i + j + 1], i and j below ``rows``, of correlations (lags, channels, channels)."""
    index = np.arange(rows)[:, None] + np.arange(rows)[None, :] + 1
    channels = R.shape[1]
    return np.asarray(R[index].transpose(0, 2, 1, 3).reshape(rows * channels, rows * channels))
