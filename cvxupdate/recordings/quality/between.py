"""Faults that show between channels of one time history: dead, unrelated and duplicated
channels."""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.quality.finding import ALPHA, Finding
from cvxupdate.recordings.quality.samples import step_of
from cvxupdate.recordings.quantiles import normal_above
from cvxupdate.recordings.types import Real, TimeHistory

_BLOCKS = 16


def coherences(data: Real) -> tuple[Real, int]:
    """Mean over the lines of the ordinary coherence of every pair, (channels, channels), from 16
    blocks apart (Hann)."""
    size = len(data) // _BLOCKS
    blocks = data[: size * _BLOCKS].reshape(_BLOCKS, size, -1)
    spectra = np.fft.rfft(
        (blocks - blocks.mean(axis=1, keepdims=True)) * np.hanning(size + 2)[1:-1, None], axis=1
    )[:, 2:-1]
    cross = np.einsum("bfi,bfj->fij", spectra, np.conj(spectra))
    power = np.real(np.einsum("fii->fi", cross))
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.abs(cross) ** 2 / (power[:, :, None] * power[:, None, :])
    return np.asarray(
        np.nanmean(np.where(np.isfinite(coherence), coherence, np.nan), axis=0)
    ), spectra.shape[1]


def dead(history: TimeHistory) -> tuple[Finding, ...]:
    """Channels that never leave two converter steps, or have three values at most (a force may: it
    can be switched)."""
    found = []
    for column, channel in enumerate(history.channels):
        x = history.data[:, column]
        x = x[np.isfinite(x)]
        if x.size < 2:
            continue
        spread = float(np.ptp(x))
        quantum = step_of(x)
        few = (
            len(np.unique(x)) <= 3 and channel.quantity != "force"
        )  # a force may be switched, a motion cannot
        if spread == 0.0 or few or (quantum > 0.0 and spread < 2.5 * quantum):
            found.append(
                Finding(
                    "dead channel",
                    name(history, column),
                    f"{name(history, column)} does not move: its {x.size} samples lie within "
                    f"{spread:.3g} of {np.mean(x):.4g} ({channel.quantity}). Check the cable "
                    "and the range.",
                    0.0,
                    0.0,
                    spread,
                )
            )
    return tuple(found)


def duplicates(history: TimeHistory) -> tuple[Finding, ...]:
    """Pairs that are one signal: after the best factor nothing is left beyond one converter step,
    or one part in 10⁶.

    Two sensors, even side by side, have noise of their own; independent noise of one part in 10⁵ is
    enough to tell them apart.
    """
    data = history.data
    ok = np.all(np.isfinite(data), axis=1)
    data = data[ok] - np.mean(data[ok], axis=0)
    found = []
    rms = np.sqrt(np.mean(data**2, axis=0))
    for i in range(data.shape[1]):
        for j in range(i + 1, data.shape[1]):
            if rms[i] == 0.0 or rms[j] == 0.0:
                continue
            factor = float(data[:, i] @ data[:, j] / (data[:, i] @ data[:, i]))
            left = float(np.sqrt(np.mean((data[:, j] - factor * data[:, i]) ** 2)))
            limit = 1e-6 * rms[j]
            if left <= limit:
                found.append(
                    Finding(
                        "duplicated channel",
                        f"{name(history, i)}, {name(history, j)}",
                        f"{name(history, i)} and {name(history, j)} are one signal (factor "
                        f"{factor:.6g}): a channel was recorded or copied twice. Leave one "
                        "out.",
                        left,
                        limit,
                        factor,
                    )
                )
    return tuple(found)


def unrelated(history: TimeHistory, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """A channel that has nothing to do with any other, although others are related.

    The coherence of two unrelated Gaussian channels over n blocks is a beta variable (1, n - 1);
    its mean over the lines is compared with that mean's normal law. Not tried where fewer than
    three channels, or no two related ones, are left.
    """
    data = history.data
    if data.shape[1] < 3 or len(data) < 64 * _BLOCKS or not np.all(np.isfinite(data)):
        return ()
    live = np.ptp(data, axis=0) > 0.0
    mean, lines = coherences(data)
    n = _BLOCKS
    expected, deviation = (
        1.0 / n,
        np.sqrt((n - 1) / (n**2 * (n + 1)) / lines * 2.0),
    )  # a Hann window halves the independent lines
    threshold = expected + normal_above(alpha / data.shape[1]) * deviation
    np.fill_diagonal(mean, 0.0)
    mean[~live] = 0.0
    mean[:, ~live] = 0.0
    best = mean.max(axis=1)
    related = best > 0.5
    if np.count_nonzero(related) < 2:
        return ()
    return tuple(
        Finding(
            "unrelated channel",
            name(history, int(c)),
            f"{name(history, int(c))} has nothing in common with any other channel (mean "
            f"coherence {best[c]:.3f}, chance gives {expected:.3f}): a broken cable, another "
            "machine's signal, or a direction that the excitation does not reach.",
            threshold,
            float(best[c]),
            float(best[c]),
        )
        for c in np.flatnonzero(live & (best < threshold))
    )


def name(history: TimeHistory, column: int) -> str:
    """How findings name a channel: number, quantity, place."""
    channel = history.channels[column]
    return f"channel {column} ({channel.quantity}{' at ' + channel.label if channel.dof else ''})"
