"""Recordings as one kind of equation, Y(s) = sᵒ H(s) U(s), on points s of the right half-plane.

Lightly damped resonances make an output error a field of narrow valleys: a model whose mode lies
one bandwidth off learns nothing from its gradient. On a line s = δ + iω the same data are smooth
over δ. Time histories that start from rest are transformed there directly (an exponential window,
exact for zero initial conditions); FRFs are carried there by Poisson's kernel, applied to measured
and modelled FRFs alike so that the ends of the band do no harm. δ = ε ω shrinks from level to
level: far-reaching first, sharp at the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.measured import band_of, excited_band
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
# of the local response: what the ordinary discretisation of a model may miss, besides noise
FLOOR = 0.01
SILENT = 1e-6  # of the recording's strongest response: rounding of single-precision files
UNSTATED = 0.01  # relative deviation of an FRF whose file gives no variance at all
MOST_LINES = 4000
LINES_AT_ONCE = 64  # of a transform: keeps its kernel in memory
SPACING = 0.7  # of points, in units of δ: the data hold no finer detail


@dataclass(frozen=True)
class Signal:
    """One recording at one level of smoothing.

    ``s`` (points,) where the model is evaluated; ``mix`` (rows, points) carries model values to
    rows (None: rows are the points); ``Y`` (rows, responses, cases) measured; ``U`` (points,
    references, cases) what drove it; ``std`` like ``Y``: noise; ``order`` of differentiation;
    ``sensors`` and ``inputs`` DOF labels.
    """

    name: str
    use: str
    level: float | None
    s: Complex
    mix: Complex | Real | None
    Y: Complex
    U: Complex
    std: Real
    order: int
    sensors: tuple[str, ...]
    inputs: tuple[str, ...]

    def scale(self) -> Real:
        """Standard deviation of each row for weighting: noise, and `FLOOR` of the response around
        it."""
        size = np.abs(self.Y)
        around = np.sqrt(np.mean(size**2, axis=0, keepdims=True))
        silent = SILENT * np.sqrt(
            np.mean(size**2)
        )  # a channel that hardly moves says nothing finer than this
        return np.sqrt(self.std**2 + (FLOOR * size) ** 2 + (0.1 * FLOOR * around) ** 2 + silent**2)

    @cached_property
    def single(self) -> bool:
        """Whether there is but one drive, in one case."""
        return self.U.shape[1:] == (1, 1)

    @cached_property
    def plain(self) -> bool:
        """Whether each case is a unit of one drive, or there is but one (see `carry`)."""
        return self.single or (
            self.U.shape[1] == self.U.shape[2] and bool(np.all(np.eye(self.U.shape[1]) == self.U))
        )

    @cached_property
    def carry(self) -> Complex | Real | None:
        """`mix` for responses to a unit of the drive where there is but one: real then, for H1
        weighs with the drive's power; None: points are rows."""
        if self.mix is None or not self.single:
            return self.mix
        carry = self.mix * self.U[:, 0, 0]
        return (
            np.ascontiguousarray(carry.real)
            if np.abs(carry.imag).max() <= 1e-12 * np.abs(carry).max()
            else carry
        )

    def audible(self) -> NDArray[np.bool_]:
        """(responses,): channels whose signal stands above their noise and above rounding of the
        recording."""
        power, noise = (np.sqrt(np.mean(np.abs(v) ** 2, axis=(0, 2))) for v in (self.Y, self.std))
        return np.asarray((power > 3.0 * noise) & (power > 10.0 * SILENT * power.max()))


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
        else UNSTATED**2
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


def smooth(lines: Lines, epsilon: float) -> Signal:
    """Lines under Poisson's kernel of half-width ε f; with several lines of drive, as the ratio of
    smoothed cross to smoothed auto spectrum (H1).

    The operation is linear in the responses, and the model's go through the same: ``epsilon`` 0
    leaves the lines as they are.
    """
    if epsilon <= 0.0:
        return Signal(
            lines.name,
            lines.use,
            lines.level,
            lines.s,
            None,
            lines.Y,
            lines.U,
            lines.std,
            lines.order,
            lines.sensors,
            lines.inputs,
        )
    keep = ~_stride_mask(
        len(lines.s), 450 if epsilon > 0.04 else 900
    )  # the same lines are dropped from the model: smoothing needs no more of them
    s, Y, U, std = lines.s[keep], lines.Y[keep], lines.U[keep], lines.std[keep]
    f = s.imag / (2.0 * np.pi)
    step = float(np.median(np.diff(f)))
    centres = _points((float(f[0]), float(f[-1])), epsilon, step)
    width = np.maximum(epsilon * centres, step)
    kernel = width[:, None] / ((centres[:, None] - f[None, :]) ** 2 + width[:, None] ** 2)
    if U.shape[2] > 1 or np.allclose(U, 1.0):
        mix = [kernel / kernel.sum(axis=1, keepdims=True)]
    else:
        mix = []
        for drive in U[:, :, 0].T:
            weighted = kernel * np.conj(drive)
            mix.append(weighted / (kernel @ np.abs(drive) ** 2)[:, None])
    whole = np.vstack(mix)
    noise = np.sqrt(_mixed(np.abs(whole) ** 2, std**2))
    return Signal(
        lines.name,
        lines.use,
        lines.level,
        s,
        whole,
        _mixed(whole, Y),
        U,
        noise,
        lines.order,
        lines.sensors,
        lines.inputs,
    )


def _mixed(mix: NDArray[Any], values: NDArray[Any]) -> NDArray[Any]:
    """(rows, lines) times (lines, sensors, cases)."""
    return np.asarray((mix @ values.reshape(len(values), -1)).reshape(len(mix), *values.shape[1:]))


def lines_of(recordings: Sequence[FrequencyResponse | TimeHistory]) -> tuple[Lines, ...]:
    """Every recording on its lines."""
    return tuple(time_lines(r) if isinstance(r, TimeHistory) else frf_lines(r) for r in recordings)


def _stride_mask(count: int, most: int) -> NDArray[np.bool_]:
    """True for lines to drop, so that at most ``most`` evenly spread ones stay."""
    stride = max(1, int(np.ceil(count / most)))
    return np.arange(count) % stride != 0


def white_noise(history: TimeHistory, columns: list[int]) -> Real:
    """Noise of each channel per sample: the spectrum above the band that the force reached, else
    what differencing leaves, (channels,)."""
    n = len(history.data)
    f = np.fft.rfftfreq(n, 1.0 / history.rate)
    quiet = f > min(1.1 * excited_band(history)[1], 0.49 * history.rate)
    spectra = np.abs(np.fft.rfft(history.data[:, columns], axis=0)) ** 2 / n
    if quiet.sum() >= 20:
        return np.sqrt(np.median(spectra[quiet], axis=0) / np.log(2.0))
    return 0.005 * np.std(history.data[:, columns], axis=0)


def _points(band: tuple[float, float], epsilon: float, least: float) -> Real:
    """Frequencies (Hz) spaced by `SPACING` δ: in proportion to frequency above ``least``; wider
    where there would be more than 1200."""
    spacing = SPACING
    while True:
        out = [band[0]]
        while out[-1] < band[1] and len(out) <= 1200:
            out.append(out[-1] + spacing * max(epsilon * out[-1], least))
        if out[-1] >= band[1]:
            return np.array(out[:-1] if len(out) > 2 else out)
        spacing *= 1.3
