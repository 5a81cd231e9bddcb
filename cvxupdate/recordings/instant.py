"""The first instant of a record that starts from rest: what jumps there jumps between two samples,
and their sum takes it for what is periodic in the sampling rate."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.types import Complex, Real

BLOW = 6.0
"""Times its r.m.s. above which a first sample of force is no beginning but a blow."""
FIRST = 24
"""Samples that the slope behind the first instant is taken from."""
PERIOD, CONTENT = 32, 0.4
"""Of the harmonics that are fitted to them, in samples; the highest, in parts of the sampling rate:
recorders pass what is below (ISO 18431-1: 1 / 2.56)."""


def sets_in(force: Real) -> bool:
    """Whether forces (samples, drives) set in with the first sample, at any strength. Blows of one
    sample do not: their momentum is all in that one."""
    size = np.sqrt(np.mean(force**2, axis=0))
    return bool(np.all(np.abs(force[0]) <= BLOW * size))


def transformed(
    data: Real, rate: float, decay: float, lines: NDArray[np.int64], begins: bool
) -> tuple[Complex, Complex]:
    """∫ e^{−st} x dt of samples (n, channels) at ``rate`` (Hz): s (lines,) = decay / T + 2πi k / T
    for the ``lines`` k, and the integrals (lines, channels). Where the record ``begins`` there, by
    the trapezoidal rule with what Euler and Maclaurin's formula has of the first instant, else by
    the plain sum.

    The terms stand for a jump and a slope at t = 0, each by its own transform less that of its
    samples, which does not become small near half the sampling rate as their powers of ``s`` do.
    """
    n = len(data)
    window = np.exp(-decay / n * np.arange(n))[:, None]
    window[0] *= 0.5 if begins else 1.0
    s = np.asarray((decay + 2j * np.pi * lines) * rate / n)
    out = np.asarray(np.fft.rfft(window * data, axis=0)[lines] / rate)
    if begins and len(s):
        half = (0.5 * s / rate)[:, None]
        out += data[0] * (1.0 / s[:, None] - 0.5 / rate / np.tanh(half))
        if n >= FIRST:
            behind = (0.5 / rate / np.sinh(half)) ** 2
            out += _slope() @ data[:FIRST] * rate * (1.0 / s[:, None] ** 2 - behind)
    return s, out


@cache
def _slope() -> Real:
    """(FIRST,) weights of the samples in the slope at the first one, per sample: of the harmonics
    that fit them best. A difference of two says nothing of what is near half the rate."""
    omega = 2.0 * np.pi * np.arange(int(CONTENT * PERIOD) + 1) / PERIOD
    phase = omega * np.arange(FIRST)[:, None]
    basis = np.hstack([np.cos(phase), np.sin(phase[:, 1:])])
    return np.asarray(np.concatenate([0.0 * omega, omega[1:]]) @ np.linalg.pinv(basis, rcond=1e-2))
