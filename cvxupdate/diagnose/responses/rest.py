"""Noise from what a record says before its force begins, and on lines that no force reached."""

from __future__ import annotations

import numpy as np
from scipy.fft import rfft
from scipy.signal.windows import tukey

from cvxupdate.diagnose.responses.signals import Real

QUIET, STILL = 16, 0.03  # samples, and what of the r.m.s. forces may scatter by at rest
FINEST = 1e-6  # of the r.m.s.: what scatters less at rest is a simulation, not an instrument
TAPERED = 0.2  # of a record, both ends together: what jumps there is on every line without a taper
UPPER = 2.0  # standard deviations of the estimate above it: a record is short before it begins


def samples_at_rest(force: Real) -> int:
    """Samples of the beginning that are surely at rest: half of those until a ``force`` (samples,
    inputs) first moves; 0 where it moves from the beginning."""
    sizes = np.std(force, axis=0)
    moves = np.any(np.abs(force - force[:QUIET].mean(axis=0)) > STILL * sizes, axis=1)
    until = int(np.argmax(moves)) if np.any(moves) else 0
    return max(QUIET, until // 2) if until >= QUIET else 0


def rest_noise(motion: Real, force: Real) -> Real:
    """Upper bound (sensors,) of the standard deviation of white noise in ``motion`` (samples,
    sensors), from the samples at rest; infinite where the record does not begin at rest. What lies
    above the band of the force is noise of a linear structure only: contact fills the whole
    spectrum."""
    n = samples_at_rest(force) if force.shape[1] else 0
    sizes = np.std(motion, axis=0)
    if n < QUIET:
        return np.full(motion.shape[1], np.inf)
    rest = np.std(motion[:n], axis=0, ddof=1)
    bound = rest * (1.0 + UPPER / np.sqrt(2.0 * n))
    return np.asarray(np.where(rest > FINEST * sizes, bound, np.inf))


def power(values: Real) -> Real:
    """Spectrum of samples (samples, channels) whose mean on a line is the variance of white noise
    per sample: (lines, channels)."""
    window = tukey(len(values), TAPERED)[:, None]
    return np.asarray(np.abs(rfft(window * values, axis=0)) ** 2 / np.sum(window**2))
