"""Recordings on the lines of the half-plane: transforms of time histories, FRFs as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.settings import UNSTATED_FRF
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
SPACING = 0.7  # of points, in units of δ: the data hold no finer detail

MOST_LINES = 4000


LINES_AT_ONCE = 64  # of a transform: keeps its kernel in memory


@dataclass(frozen=True)
class Lines:
    """One recording as it is: ``s`` (lines,), ``Y`` and ``std`` (lines, responses, cases), ``U``
    (lines, references, cases)."""

    name: str
    use: str
    level: float | None
    s: Complex
    Y: Complex
    U: Complex
    std: Real
    order: int
    sensors: tuple[str, ...]
    inputs: tuple[str, ...]


def time_lines(history: TimeHistory) -> Lines:
    """A time history that starts from rest, on s = δ + iω with δ = 7 / T: what is cut off at the
    end weighs e⁻⁷."""
    drives = [i for i, c in enumerate(history.channels) if c.quantity == "force"]
    senses = [i for i, c in enumerate(history.channels) if c.quantity in ORDER]
    rate, n = history.rate, len(history.data)
    delta = 7.0 * rate / n
    band = band_of(history)
    f = np.arange(
        band[0], band[1], max(SPACING * delta / (2.0 * np.pi), (band[1] - band[0]) / MOST_LINES)
    )
    s: Complex = np.asarray(delta + 2j * np.pi * f, dtype=np.complex128)
    t = np.arange(n) / rate
    out = np.empty((len(s), history.data.shape[1]), dtype=complex)
    damped = np.exp(-delta * t)[:, None] * history.data / rate
    kernel = np.exp(
        -2j * np.pi * np.outer(f[:LINES_AT_ONCE] - f[0], t)
    )  # lines lie evenly: the same kernel, turned, serves every part
    for start in range(0, len(s), LINES_AT_ONCE):
        part = f[start : start + LINES_AT_ONCE]
        out[start : start + len(part)] = kernel[: len(part)] @ (
            np.exp(-2j * np.pi * part[0] * t)[:, None] * damped
        )
    noise = white_noise(history, senses) * np.linalg.norm(np.exp(-delta * t)) / rate
    Y, U = out[:, senses][:, :, None], out[:, drives][:, :, None]
    std = np.broadcast_to(noise[None, :, None], Y.shape).copy()
    c = history.channels
    return Lines(
        history.origin.name,
        history.origin.use,
        history.origin.level,
        s,
        Y,
        U,
        std,
        ORDER[c[senses[0]].quantity],
        tuple(c[i].label for i in senses),
        tuple(c[i].label for i in drives),
    )


def frf_lines(frf: FrequencyResponse) -> Lines:
    """FRFs on their own lines; variances that were not recorded are taken from those that were."""
    band = band_of(frf)
    keep = (
        (frf.frequency >= band[0])
        & (frf.frequency <= band[1])
        & np.all(np.isfinite(frf.H), axis=(1, 2))
    )
    f, H = frf.frequency[keep], frf.H[keep]
    variance = frf.variance[keep] if frf.variance is not None else np.full(H.shape, np.nan)
    power = np.mean(np.abs(H) ** 2, axis=0, keepdims=True)
    relative = variance / np.maximum(power, np.finfo(float).tiny)
    typical = (
        float(np.median(relative[np.isfinite(relative)]))
        if np.any(np.isfinite(relative))
        else UNSTATED_FRF**2
    )
    own = np.array(
        [
            [np.median(v[np.isfinite(v)]) if np.any(np.isfinite(v)) else np.nan for v in row.T]
            for row in np.swapaxes(variance, 0, 1)
        ]
    )[None]
    variance = np.where(
        np.isfinite(variance), variance, np.where(np.isfinite(own), own, typical * power)
    )
    references = len(frf.references)
    U = np.broadcast_to(np.eye(references, dtype=complex), (len(f), references, references))
    return Lines(
        frf.origin.name,
        frf.origin.use,
        frf.origin.level,
        2j * np.pi * f,
        H,
        U,
        np.sqrt(variance),
        ORDER[frf.quantity],
        tuple(c.label for c in frf.responses),
        tuple(c.label for c in frf.references),
    )


def lines_of(recordings: Sequence[FrequencyResponse | TimeHistory]) -> tuple[Lines, ...]:
    """Every recording on its lines."""
    return tuple(time_lines(r) if isinstance(r, TimeHistory) else frf_lines(r) for r in recordings)


def band_of(recording: FrequencyResponse | TimeHistory) -> tuple[float, float]:
    """The band (Hz) that the excitation reached: where the force's spectrum is above a tenth of its
    typical value; an FRF's own lines."""
    if isinstance(recording, FrequencyResponse):
        positive = recording.frequency[recording.frequency > 0]
        return float(positive[0]), float(positive[-1])
    drives = [i for i, c in enumerate(recording.channels) if c.quantity == "force"]
    n = len(recording.data)
    f = np.fft.rfftfreq(n, 1.0 / recording.rate)
    spectrum = np.sqrt(np.sum(np.abs(np.fft.rfft(recording.data[:, drives], axis=0)) ** 2, axis=1))
    lines = max(5, n // 200)
    smooth = np.sqrt(np.convolve(spectrum**2, np.ones(lines) / lines, mode="same"))
    loud = np.flatnonzero(smooth > 0.1 * np.percentile(smooth, 90))
    top = min(f[loud[-1]], 0.45 * recording.rate) if len(loud) else 0.4 * recording.rate
    return max(float(f[loud[0]]) if len(loud) else 0.0, 8.0 * recording.rate / n), float(0.98 * top)


def white_noise(history: TimeHistory, columns: list[int]) -> Real:
    """Noise of each channel per sample: the spectrum above the band that the force reached, else
    what differencing leaves, (channels,)."""
    n = len(history.data)
    f = np.fft.rfftfreq(n, 1.0 / history.rate)
    quiet = f > min(1.1 * band_of(history)[1], 0.49 * history.rate)
    spectra = np.abs(np.fft.rfft(history.data[:, columns], axis=0)) ** 2 / n
    if quiet.sum() >= 20:
        return np.sqrt(np.median(spectra[quiet], axis=0) / np.log(2.0))
    return 0.005 * np.std(history.data[:, columns], axis=0)
