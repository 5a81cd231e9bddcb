"""Noise from what a record says before its force begins, and on lines that no force reached."""

from __future__ import annotations

import numpy as np
from scipy.fft import rfft
from scipy.signal.windows import tukey

from cvxupdate.diagnose.responses.signals import Complex, Real

QUIET, STILL = 16, 0.03  # samples, and what of the r.m.s. forces may scatter by at rest
FINEST = 1e-6  # of the r.m.s.: what scatters less at rest is a simulation, not an instrument
TAPERED = 0.2  # of a record, both ends together: what jumps there is on every line without a taper
BEYOND, HIGHEST = 1.1, 0.49  # times the band's top, and of the rate: lines that no force reached
LINES = 20  # of them from which on they tell the noise; and neighbours that have one force
FORCED = 3.0  # times the noise of a force's lines that make them forced
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


def beyond_band(values: Real, rate: float, top: float) -> Real:
    """Standard deviation per sample (channels,) of white noise, from the lines of ``values``
    (samples, channels) above a band up to ``top`` (Hz); infinite where there are few."""
    f = np.fft.rfftfreq(len(values), 1.0 / rate)
    quiet = f > min(BEYOND * top, HIGHEST * rate)
    if quiet.sum() < LINES:
        return np.full(values.shape[1], np.inf)
    return np.asarray(np.sqrt(np.median(power(values)[quiet], axis=0) / np.log(2.0)))


def force_noise(force: Real) -> Real:
    """Standard deviation per sample (inputs,) of the noise of the channels of ``force`` (samples,
    inputs), which is an error of what drives the model: what they say at rest, 0 where they never
    rest. What is above their band may be force."""
    noise = rest_noise(force, force)
    return np.asarray(np.where(np.isfinite(noise), noise, 0.0))


def through(noise: Real, Y: Complex, U: Complex) -> Real:
    """What deviations ``noise`` (inputs,) of the lines of forces U (lines, inputs, 1) make of those
    of responses Y (lines, sensors, 1), like Y: in proportion to the response where lines were
    forced, and elsewhere, where the response is something else, to that of the strongest."""
    if not np.any(noise):
        return np.zeros(Y.shape)
    square = np.sum(np.abs(U[:, :, 0]) ** 2, axis=1)
    count = min(LINES, len(square))
    local = np.convolve(square, np.ones(count) / count, mode="same")
    sigma = float(np.sqrt(np.sum(noise**2)))
    size = np.sqrt(np.where(local > (FORCED * sigma) ** 2, local, local.max()))
    return np.asarray(np.abs(Y) * (sigma / size)[:, None, None])
