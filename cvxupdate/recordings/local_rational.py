"""Spectra of one record as H U + T: FRFs and the transient of its initial state, by local rational
models.

Around each line H = B/A and T = C/A with one A of second degree, so that a resonance narrower than
the window is met exactly: T. McKelvey and G. Guérin, "Non-parametric frequency response estimation
using a local rational model", IFAC SYSID 2012, 49; the transient as in Pintelon and Schoukens,
*System Identification*, 2nd ed. (2012), chapter 7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real

Index = NDArray[np.int64]

DEGREE = 2
"""Of A, B and C in the line number: one resonance, and what others make of its surroundings."""
FREEDOM = 7
"""Residual degrees of freedom of each local fit, from which its noise is known."""
BATCH = 2048
DEPENDENT = 1e-9  # of the largest pivot: references that are zero or copies of one another


@dataclass(frozen=True)
class LocalModels:
    """At each line: ``H`` (lines, outputs, inputs) and its ``variance``; ``transient`` T (lines,
    outputs); ``residual`` and ``without`` (lines, outputs), squares left with and without a
    transient over ``half`` lines to either side, ``left`` degrees of freedom with it."""

    H: Complex
    variance: Real
    transient: Complex
    residual: Real
    without: Real
    half: int
    left: int


def half_width(inputs: int) -> int:
    """Lines to either side of the one that is estimated."""
    unknowns = (DEGREE + 1) * (inputs + 1) + DEGREE
    return -(-(unknowns + FREEDOM - 1) // 2)


def forced(U: Complex, half: int) -> NDArray[np.bool_]:
    """Lines (lines,) around which the forces ``U`` (lines, inputs) are above a tenth of what is
    typical of them, as those of a band are (`cvxupdate.recordings.measured.excited_band`)."""
    around = _around(np.sum(np.abs(U) ** 2, axis=1), half)
    return np.asarray(around > 0.01 * np.percentile(around, 90))


def acting(U: Complex, half: int) -> NDArray[np.bool_]:
    """Lines (lines,) of their own on which forces act, with a hundredth of the mean power around:
    a force that repeats itself in a record has noise on the others."""
    power = np.sum(np.abs(U) ** 2, axis=1)
    return np.asarray(power > 0.01 * _around(power, half))


def filled(U: Complex, half: int) -> bool:
    """Whether forces act on as many lines around each as tell B (lines without a force tell A and
    the transient), in the median of those that are forced."""
    count = (2 * half + 1) * _around(acting(U, half).astype(float), half)
    return bool(np.median(count[forced(U, half)]) > DEGREE + 0.5)


def _around(power: Real, half: int) -> Real:
    """Mean over ``half`` lines to either side."""
    return np.convolve(power, np.ones(2 * half + 1) / (2 * half + 1), mode="same")


def local_rational(U: Complex, Y: Complex, stride: int = 1) -> LocalModels:
    """Local models of spectra ``U`` (lines, inputs) and ``Y`` (lines, outputs) on even lines, at
    every ``stride``-th of them; NaN where the inputs are dependent.

    Raises
    ------
    RecordingError
        When there are fewer lines than a window holds.
    """
    half = half_width(U.shape[1])
    if len(U) < 2 * half + 1:
        raise RecordingError(
            f"{len(U)} lines in the band are too few for a local fit over {2 * half + 1}; record "
            "longer, or widen the band."
        )
    centres = np.arange(0, len(U), stride)
    parts = []
    for start in range(0, len(centres), BATCH):
        some = centres[start : start + BATCH]
        each = [_fit(U, Y[:, k], some, half) for k in range(Y.shape[1])]
        parts.append([np.stack([e[q] for e in each], axis=1) for q in range(5)])
    H, variance, T, residual, without = (np.concatenate([p[q] for p in parts]) for q in range(5))
    left = 2 * half + 1 - (DEGREE + 1) * (U.shape[1] + 1) - DEGREE
    return LocalModels(H, variance.real, T, residual.real, without.real, half, left)


def _fit(
    U: Complex, y: Complex, centres: Index, half: int
) -> tuple[Complex, Real, Complex, Real, Real]:
    """H (centres, inputs), its variance, T, and squares left with and without T, of one output."""
    lines, count = len(U), len(centres)
    # at the ends of the band the window is shifted inward; r is measured from the line itself
    index = np.clip(centres, half, lines - 1 - half)[:, None] + np.arange(-half, half + 1)
    r = (index - centres[:, None]) / half
    powers = r[:, :, None] ** np.arange(DEGREE + 1)
    u, here = U[index], y[index]
    forced = (powers[:, :, :, None] * u[:, :, None, :]).reshape(count, 2 * half + 1, -1)
    poles = -powers[:, :, 1:] * here[:, :, None]
    theta, spread, rest = _least_squares([forced, poles, powers.astype(complex)], here)
    plain = _least_squares([forced, poles], here)[2]
    noise = rest / max(2 * half + 1 - theta.shape[1], 1)
    transient, inputs = theta[:, forced.shape[2] + DEGREE], U.shape[1]
    return theta[:, :inputs], noise[:, None] * spread[:, :inputs], transient, rest, plain


def _least_squares(parts: list[Complex], y: Complex) -> tuple[Complex, Real, Real]:
    """Solutions (lines, unknowns), the squares of their spread by unit noise, squares left."""
    K = np.concatenate(parts, axis=2)
    scale = np.linalg.norm(K, axis=1, keepdims=True)
    scale = np.where(scale > 0.0, scale, 1.0)
    Q, R = np.linalg.qr(K / scale)
    pivots = np.abs(np.einsum("fii->fi", R))
    singular = pivots.min(axis=1) < DEPENDENT * pivots.max(axis=1)
    inverse = np.linalg.inv(np.where(singular[:, None, None], np.eye(R.shape[1]), R))
    projected = np.conj(Q.transpose(0, 2, 1)) @ y[:, :, None]
    theta = (inverse @ projected)[:, :, 0] / scale[:, 0]
    rest = np.sum(np.abs(y - (Q @ projected)[:, :, 0]) ** 2, axis=1)
    spread = np.sum(np.abs(inverse) ** 2, axis=2) / scale[:, 0] ** 2
    theta[singular] = np.nan
    return theta, spread, np.asarray(rest)
