"""FRFs of one recording as mobility, for comparison with those of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.lines import sine_fit, vertex
from cvxupdate.recordings.local_rational import (
    Index,
    acting,
    filled,
    forced,
    half_width,
    local_rational,
)
from cvxupdate.recordings.periodic import excited_lines
from cvxupdate.recordings.quality.frf import mobility, place
from cvxupdate.recordings.quantiles import excess_kurtosis
from cvxupdate.recordings.read.variance import variance_of_frf
from cvxupdate.recordings.spectral import LONGEST, frf_from_time
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

IMPULSIVE = 30.0
"""Excess kurtosis of a force that is an impact."""
MOST_LINES = 2**14
"""Lines with a local model of their own; of more every second, third … has one."""


@dataclass(frozen=True)
class Estimate:
    """One FRF of one recording as mobility: lines or a single frequency, with its variance.

    ``shared`` is the number of neighbouring lines that share data where each is from a local model,
    which smears no peak; 0 where it was averaged, or is as given.
    """

    origin: Origin
    key: tuple[tuple[int, str], str, tuple[int, str]]
    response: Channel
    reference: Channel
    frequency: Real
    H: Complex
    variance: Real
    shared: int = 0

    @property
    def noise(self) -> Real:
        """Variance over |H|², each line."""
        return np.asarray(self.variance / np.maximum(np.abs(self.H) ** 2, np.finfo(float).tiny))

    @property
    def narrow(self) -> bool:
        """A sine test: one frequency."""
        return len(self.frequency) == 1


def _of_frf(frf: FrequencyResponse, shared: int = 0) -> list[Estimate]:
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
            shared,
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
    """A sine by least squares, an impact by output over input, anything else by
    `_broad`; one force only."""
    forces = [k for k, c in enumerate(history.channels) if c.quantity == "force" and c.dof]
    motions = [k for k, c in enumerate(history.channels) if c.quantity in MOTIONS and c.dof]
    if (
        len(forces) != 1
        or not motions
        or len(history.data) < 128
        or not np.all(np.isfinite(history.data))
    ):
        return []
    force = forces[0]
    if np.ptp(history.data[:, force]) == 0.0:
        return []
    tone = _sine(history, force)
    if tone is None and excess_kurtosis(history.data[:, force]) <= IMPULSIVE:
        return _broad(history, motions, force)
    out: list[Estimate] = []
    for k in motions:
        found = _hit(history, k, force) if tone is None else _at_tone(history, k, force, tone)
        out += _of_frf(_single(history, k, force, *found))
    return out


def _single(
    history: TimeHistory, motion: int, force: int, f: Real, H: Complex, variance: Real | None
) -> FrequencyResponse:
    """The FRF of one response."""
    r, s = history.channels[motion], history.channels[force]
    return FrequencyResponse(history.origin, f, H, r.quantity, (r,), (s,), variance)


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


def _hit(history: TimeHistory, motion: int, force: int) -> tuple[Real, Complex, Real | None]:
    """Lines, H and variance of an impact: the rest of the force channel is noise."""
    U, Y = (
        np.fft.rfft(x - np.median(x)) for x in (history.data[:, force], history.data[:, motion])
    )
    grid = np.asarray(np.fft.rfftfreq(len(history.data), 1.0 / history.rate), dtype=np.float64)
    H = (Y / np.where(U == 0.0, 1.0, U))[1:, None, None]
    return grid[1:], H, variance_of_frf(H, None)[0]


def _broad(history: TimeHistory, motions: list[int], force: int) -> list[Estimate]:
    """All responses to a broad-band force or a sweep: without leakage, by a local model at each
    line, or output over input at the lines of a force that repeats itself; of a long record by H1
    over half-overlapped Hann blocks. A sweep passes a resonance within one such block."""
    if len(history.data) > LONGEST:
        quantities = dict.fromkeys(history.channels[k].quantity for k in motions)
        return [
            e
            for q in quantities
            for e in _of_frf(frf_from_time(history, quantity=q, references=(force,)))
        ]
    spectra = np.fft.rfft(history.data[:, [force, *motions]], axis=0)
    at, H, variance, shared = _at_lines(spectra[:, :1], spectra[:, 1:])
    if variance is None:
        return []
    f = np.asarray(at * history.rate / len(history.data), dtype=np.float64)
    out: list[Estimate] = []
    for k, column in enumerate(motions):
        own = slice(k, k + 1)
        out += _of_frf(_single(history, column, force, f, H[:, own], variance[:, own]), shared)
    return out


def _at_lines(U: Complex, Y: Complex) -> tuple[Index, Complex, Real | None, int]:
    """Lines, H (lines, outputs, 1), its variance (None: too few lines) and how many lines share
    data, from spectra (0 Hz first): by local models where these are told."""
    if filled(U[1:], half_width(1)):
        stride = -(-(len(U) - 1) // MOST_LINES)
        found = local_rational(U[1:], Y[1:], stride)
        driven = (forced(U[1:], found.half) & acting(U[1:], found.half))[::stride]
        known = driven & np.all(np.isfinite(found.H), axis=(1, 2))
        if 2 * np.count_nonzero(known) > np.count_nonzero(driven):
            at = np.arange(1, len(U), stride)[known]
            return at, found.H[known], found.variance[known], 2 * found.half // stride + 1
    at = excited_lines(U[None], [0])
    H = (Y[at] / U[at])[:, :, None]
    return at, H, variance_of_frf(H, None)[0], 0


def estimates_of(recording: Recording) -> list[Estimate]:
    """Every FRF of a recording; none for a table of modes."""
    if isinstance(recording, FrequencyResponse):
        return _of_frf(recording)
    return _of_time(recording) if isinstance(recording, TimeHistory) else []
