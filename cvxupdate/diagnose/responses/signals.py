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
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.settings import RESPONSE_DISCREPANCY

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

SPACING = 0.7  # of points, in units of δ: the data hold no finer detail
SILENT = 1e-6  # of the recording's strongest response: rounding of single-precision files


@dataclass(frozen=True)
class Signal:
    """One recording at one level of smoothing.

    ``s`` (points,) where the model is evaluated; ``mix`` (rows, points) carries model values to
    rows (None: rows are the points); ``Y`` (rows, responses, cases) measured; ``U`` (points,
    references, cases) what drove it; ``std`` like ``Y``: noise; ``order`` of differentiation;
    ``sensors`` and ``inputs`` DOF labels; ``missed`` like ``Y``: what a model that was brought to
    a reference state left of it there, as a fraction of the response around (None: no reference).
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
    missed: Real | None = None

    def scale(self) -> Real:
        """Standard deviation of each row for weighting: noise, and `RESPONSE_DISCREPANCY` of the
        response around it, or what a reference says that the model misses of it."""
        size = np.abs(self.Y)
        around = np.sqrt(np.mean(size**2, axis=0, keepdims=True))
        # a channel that hardly moves says nothing finer than this
        silent = SILENT * np.sqrt(np.mean(size**2))
        local, overall = RESPONSE_DISCREPANCY * size, 0.1 * RESPONSE_DISCREPANCY * around
        usual: Real = self.std**2 + local**2 + overall**2 + silent**2
        return np.sqrt(usual if self.missed is None else usual + (self.missed * size) ** 2)

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


def independent(signals: Sequence[Signal], modes: int) -> tuple[float, int]:
    """How many figures are independent of so many modes, and rows, of real and imaginary parts: a
    frequency and a damping ratio for each, a gain for each channel."""
    rows = sum(2 * s.Y.size for s in signals)
    channels = sum(s.Y.shape[1] * s.Y.shape[2] for s in signals)
    return float(min(rows, 2 * modes + channels)), rows


def smoothed(sharp: Signal, epsilon: float) -> Signal:
    """A signal under Poisson's kernel of half-width ε f; with several lines of drive, as the ratio
    of smoothed cross to smoothed auto spectrum (H1).

    The operation is linear in the responses, and the model's go through the same.
    """
    # the same lines are dropped from the model: smoothing needs no more of them
    keep = ~_stride_mask(len(sharp.s), 450 if epsilon > 0.04 else 900)
    s, Y, U, std = sharp.s[keep], sharp.Y[keep], sharp.U[keep], sharp.std[keep]
    f = s.imag / (2.0 * np.pi)
    step = float(np.median(np.diff(f)))
    centres = _points((float(f[0]), float(f[-1])), epsilon, step)
    width = np.maximum(epsilon * centres, step)
    kernel = width[:, None] / ((centres[:, None] - f[None, :]) ** 2 + width[:, None] ** 2)
    if U.shape[2] > 1 or np.allclose(U, 1.0):
        mix = [kernel / kernel.sum(axis=1, keepdims=True)]
    else:
        mix = [
            kernel * np.conj(drive) / (kernel @ np.abs(drive) ** 2)[:, None]
            for drive in U[:, :, 0].T
        ]
    whole = np.vstack(mix)
    noise = np.sqrt(_mixed(np.abs(whole) ** 2, std**2))
    missed = None
    if sharp.missed is not None:
        even = np.abs(whole) / np.abs(whole).sum(axis=1, keepdims=True)
        missed = np.sqrt(_mixed(even, sharp.missed[keep] ** 2))
    return replace(sharp, s=s, mix=whole, Y=_mixed(whole, Y), U=U, std=noise, missed=missed)


def thinned(signal: Signal, most: int) -> Signal:
    """A smoothed signal whose model is evaluated at ``most`` points or as many as it has rows, each
    for the mean of several neighbouring ones, off the axis by half of their width: within an eighth
    of the largest, for comparisons among many models. As it is where that would not halve them."""
    count, most = len(signal.s), max(most, len(signal.Y))
    if signal.mix is None or signal.carry is None or not signal.plain or count < 2 * most:
        return signal
    first = np.linspace(0, count, most, endpoint=False).astype(np.int64)
    carry = np.add.reduceat(signal.carry, first, axis=1)
    sizes = np.diff([*first, count])
    step = float(np.median(np.abs(np.diff(signal.s))))
    s = np.asarray(np.add.reduceat(signal.s, first) / sizes + step * sizes / 2.0, dtype=complex)
    U = np.broadcast_to(np.eye(signal.U.shape[1]), (most, *signal.U.shape[1:]))
    return replace(signal, s=s, mix=carry, U=U.astype(complex))


def _mixed(mix: NDArray[Any], values: NDArray[Any]) -> NDArray[Any]:
    """(rows, lines) times (lines, sensors, cases)."""
    return np.asarray((mix @ values.reshape(len(values), -1)).reshape(len(mix), *values.shape[1:]))


def _stride_mask(count: int, most: int) -> NDArray[np.bool_]:
    """True for lines to drop, so that at most ``most`` evenly spread ones stay."""
    stride = max(1, int(np.ceil(count / most)))
    return np.arange(count) % stride != 0


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
