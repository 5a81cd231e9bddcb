"""FRFs of one recording as mobility, for comparison with those of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.lines import sine_fit, vertex
from cvxupdate.recordings.quality.frf import mobility, place
from cvxupdate.recordings.quantiles import excess_kurtosis
from cvxupdate.recordings.read.variance import variance_of_frf
from cvxupdate.recordings.types import (
    MOTIONS,
    Channel,
    Complex,
    FrequencyResponse,
    Origin,
    Real,
    Recording,
    TimeHistory,
)


@dataclass(frozen=True)
class Estimate:
    """One FRF of one recording as mobility: lines or a single frequency, with its variance."""

    origin: Origin
    key: tuple[tuple[int, str], str, tuple[int, str]]
    response: Channel
    reference: Channel
    frequency: Real
    H: Complex
    variance: Real

    @property
    def noise(self) -> Real:
        """Variance over |H|², each line."""
        return np.asarray(self.variance / np.maximum(np.abs(self.H) ** 2, np.finfo(float).tiny))

    @property
    def narrow(self) -> bool:
        """A sine test: one frequency."""
        return len(self.frequency) == 1


def _of_frf(frf: FrequencyResponse) -> list[Estimate]:
    mob = mobility(frf)
    variance = frf.variance if frf.variance is not None else variance_of_frf(frf.H, None)[0]
    if variance is None:
        return []
    scale = np.abs(mob / np.where(frf.H == 0.0, 1.0, frf.H)) ** 2
    return [
        Estimate(
            frf.origin,
            (place(r), frf.quantity, place(s)),
            r,
            s,
            frf.frequency,
            mob[:, i, j],
            (variance * scale)[:, i, j],
        )
        for i, r in enumerate(frf.responses)
        for j, s in enumerate(frf.references)
        if r.dof and s.dof
    ]


def _sine(history: TimeHistory, force: int) -> float | None:
    """Frequency of the force if it is a sine (90 % of its power), None otherwise."""
    x = history.data[:, force] - history.data[:, force].mean()
    if not np.all(np.isfinite(x)) or np.ptp(x) == 0.0:
        return None
    power = np.abs(np.fft.rfft(x * np.hanning(len(x)), 4 * len(x)))
    start = (
        (int(np.argmax(power)) + vertex(power, int(np.argmax(power)))[0])
        * history.rate
        / (4 * len(x))
    )
    if start <= 0.0:
        return None
    frequency, _, residual = sine_fit(x[:, None], history.rate, start)
    return frequency if float(residual[0]) ** 2 < 0.1 * float(np.var(x)) else None


def _of_time(history: TimeHistory) -> list[Estimate]:
    """A sine by least squares, an impact by output over input, anything else by H1 over
    half-overlapped Hann blocks; one force only."""
    forces = [k for k, c in enumerate(history.channels) if c.quantity == "force" and c.dof]
    motions = [k for k, c in enumerate(history.channels) if c.quantity in MOTIONS and c.dof]
    if (
        len(forces) != 1
        or not motions
        or len(history.data) < 128
        or not np.all(np.isfinite(history.data))
    ):
        return []
    tone = _sine(history, forces[0])
    out: list[Estimate] = []
    for k in motions:
        found = (
            _broad(history, k, forces[0]) if tone is None else _at_tone(history, k, forces[0], tone)
        )
        if found is not None:
            f, H, variance = found
            r = history.channels[k]
            out += _of_frf(
                FrequencyResponse(
                    history.origin,
                    f,
                    H,
                    r.quantity,
                    (r,),
                    (history.channels[forces[0]],),
                    variance,
                )
            )
    return out


def _at_tone(
    history: TimeHistory, motion: int, force: int, tone: float
) -> tuple[Real, Complex, Real]:
    """Frequency, H and variance of a sine test, from the amplitudes of both channels."""
    frequency, amplitude, residual = sine_fit(history.data[:, [motion, force]], history.rate, tone)
    H = np.array([[[amplitude[0] / amplitude[1]]]])
    tiny = np.finfo(float).tiny
    noise = float(np.sum((residual / np.maximum(np.abs(amplitude), tiny)) ** 2))
    variance = np.asarray(4.0 / len(history.data) * noise * np.abs(H) ** 2, dtype=np.float64)
    return np.array([frequency], dtype=np.float64), H, variance


def _broad(history: TimeHistory, motion: int, force: int) -> tuple[Real, Complex, Real] | None:
    """Lines, H and variance of a broad-band test; None where too few lines are left."""
    u, y = history.data[:, force], history.data[:, motion]
    if excess_kurtosis(u) > 30.0:  # an impact: the rest of the force channel is noise
        U, Y = np.fft.rfft(u - np.median(u)), np.fft.rfft(y - np.median(y))
        grid: Real = np.asarray(np.fft.rfftfreq(len(u), 1.0 / history.rate), dtype=np.float64)
        H, gamma = (Y / np.where(U == 0.0, 1.0, U))[:, None, None], None
    else:
        from scipy import signal

        size = int(2 ** max(6, np.floor(np.log2(len(u) / 8))))
        grid, cross = signal.csd(u, y, history.rate, nperseg=size)
        power = signal.welch(u, history.rate, nperseg=size)[1]
        H = (cross / np.maximum(power, np.finfo(float).tiny))[:, None, None]
        gamma = signal.coherence(u, y, history.rate, nperseg=size)[1][:, None, None]
    variance, _ = variance_of_frf(H, gamma)
    return None if variance is None else (grid[1:], H[1:], variance[1:])


def estimates_of(recording: Recording) -> list[Estimate]:
    """Every FRF of a recording; none for a table of modes."""
    if isinstance(recording, FrequencyResponse):
        return _of_frf(recording)
    return _of_time(recording) if isinstance(recording, TimeHistory) else []
