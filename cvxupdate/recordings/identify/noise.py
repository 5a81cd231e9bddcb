"""The noise of FRFs that state none: a floor, and a part of the response.

Noise of the channels is the same on every line; noise of the force, of the calibration and of
leakage goes with the response, and on a resonance it is a thousand times the floor. Taken for a
floor alone it looks like further modes there. Both parts are estimated from the misfit,
|e|² = α + β |Ĥ|² in the mean, by iterated least squares weighted with the squares of what they give
(|e|² of complex noise is exponentially distributed: its deviation is its mean).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.types import Complex, Real

SURE = 3e-3  # of the response: linearity and cross-talk of good transducers are no modes
# Of the response, at most: what is more is not noise but a misfit (leakage, a stiffness that goes
# with the level), which sits on resonances, too, and must not make them unsure: it is spread over
# all lines.
MOST = 0.1
STEPS = 8  # of the iteration, which settles in three or four
RANGE = 30.0  # of amplitudes within which every line counts alike at first: a mode of 1.7 % damping
TAIL = 9.0  # times its mean: a misfit beyond, one line in 8000, is a mode that is missing
ROUNDING = 1e-24  # of the mean power of an FRF: its rounding
FLAT = 1e-9  # variation of a response's power that tells the two parts apart
SMALL = 1e-12  # of the mean misfit: no line's is less in the weights
LEAST = 0.1  # of the usual variance of its kind: an FRF must not rule because its misfit is small


def variance_of(misfit: Complex, modelled: Complex) -> Real:
    """Variance on every line, from what a fit leaves, each (lines, outputs, inputs)."""
    squares, power = np.abs(misfit) ** 2, np.abs(modelled) ** 2
    left, mean = np.mean(squares, axis=0), np.mean(power, axis=0)
    y, x = (v / np.where(m > 0.0, m, 1.0) for v, m in ((squares, left), (power, mean)))
    floor, part = np.ones_like(left), np.zeros_like(left)
    for _ in range(STEPS):
        expected = np.maximum(floor + part * x, SMALL)
        floor, part = _solved(np.minimum(y, TAIL * expected), x, 1.0 / expected**2)
    variance = left * floor + np.clip(left * part, SURE**2 * mean, MOST**2 * mean) * x
    variance *= np.maximum(left / np.where(left > 0.0, np.mean(variance, axis=0), 1.0), 1.0)
    own = np.mean(variance, axis=0)
    lift = np.maximum(LEAST * np.median(own, axis=0) - own, 0.0)
    return np.asarray(np.maximum(variance + lift, ROUNDING * mean))


def _solved(squares: Real, x: Real, weights: Real) -> tuple[Real, Real]:
    """Floor and part (outputs, inputs), neither below zero, of least weighted squares."""
    w, wx, wxx = (np.sum(weights * x**k, axis=0) for k in range(3))
    y, yx = (np.sum(weights * squares * x**k, axis=0) for k in range(2))
    determinant = w * wxx - wx**2
    flat = determinant <= FLAT * w * wxx  # a response that is the same on all lines: a floor
    determinant = np.where(flat, 1.0, determinant)
    floor, part = (y * wxx - yx * wx) / determinant, (yx * w - y * wx) / determinant
    part = np.where(flat, -1.0, part)
    alone = np.where(w > 0.0, y / np.where(w > 0.0, w, 1.0), 0.0)
    with_it = np.where(wxx > 0.0, yx / np.where(wxx > 0.0, wxx, 1.0), 0.0)
    floor, part = np.where(part < 0.0, alone, floor), np.where(part < 0.0, 0.0, part)
    return np.where(floor < 0.0, 0.0, floor), np.where(floor < 0.0, with_it, part)


def level_of(power: Real, level: Real, coupled: NDArray[np.bool_]) -> Real:
    """What stands for the deviation before anything is fitted, (lines, outputs, inputs): the usual
    level of an FRF, of the ``power`` |H|² on all lines, ``level`` at most (that where nothing is
    ``coupled``; both (outputs, inputs)); and a part of what stands far above. Between lines an
    undamped resonance is as high as chance has it, and one line must not say all."""
    usual = np.median(power, axis=0)
    usual = np.where(coupled & (usual > 0.0), np.minimum(usual, level**2), level**2)
    return np.asarray(np.sqrt(usual + power / RANGE**2))
