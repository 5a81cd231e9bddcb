"""Whether the recordings depend on the drive level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.diagnose.types import LevelChange

LEAST_LINES = 20  # that two records have in common
GAIN = 0.01  # relative: by which that of a sensor may change from one level to another
NARROW = 1.5  # highest over lowest frequency: in narrower bands nothing is compared


def level_change(signals: Sequence[Signal], one: bool = False) -> LevelChange | None:
    """The largest change of the transfer function between runs at two drive levels (at ``one``
    level, which only time tells apart); None where no two runs compare.

    A record that starts from rest gives H(s) = Y(s) / U(s) at every s without averaging, so two
    runs of one linear structure agree to noise.
    """
    changes: list[LevelChange | None] = []
    single = [s for s in signals if s.single and s.level is not None]
    for i, a in enumerate(single):
        for b in single[i + 1 :]:
            if (
                (a.level == b.level) != one
                or a.name == b.name
                or a.inputs != b.inputs
                or a.sensors != b.sensors
            ):
                continue
            changes.append(_on_lines(a, b) or _of_frfs(a, b))
    return max((c for c in changes if c), key=lambda c: c.change, default=None)


def state_change(before: Sequence[Signal], after: Sequence[Signal]) -> LevelChange | None:
    """The largest change of the transfer function from one state of a structure to another, of
    signals with the same channels; None where there are none."""
    alike = [
        (a, b)
        for a in before
        for b in after
        if (a.single and b.single) and (a.inputs, a.sensors) == (b.inputs, b.sensors)
    ]
    changes = (_smoothed(a, b) for a, b in alike)
    return max((c for c in changes if c), key=lambda c: c.change, default=None)


def left_between(
    fitted: Sequence[Signal], other: Sequence[Signal], left: Sequence[Complex]
) -> float:
    """The largest change of the transfer function from one of the signals that were ``fitted`` to
    one of ``other`` at another level, of what a model leaves of these (``left``, of both, like
    their Y), as a fraction of the responses. What a model misses at every level alike is none of
    it. NaN where no two compare."""
    both, count = (*fitted, *other), len(fitted)
    left_of = [replace(s, Y=own) for s, own in zip(both, left, strict=True)]
    changes = [
        found.change
        for i, a in enumerate(fitted)
        for j, b in enumerate(other)
        if a.level != b.level and _compare(a, b)
        if (found := _on_lines(a, b, (left_of[i], left_of[count + j])))
    ]
    return max(changes, default=float("nan"))


def _compare(a: Signal, b: Signal) -> bool:
    alike = a.inputs == b.inputs and a.sensors == b.sensors and a.order == b.order
    return a.single and b.single and a.name != b.name and alike


def _on_lines(
    a: Signal, b: Signal, left: tuple[Signal, Signal] | None = None
) -> LevelChange | None:
    """On common lines: two records of one linear structure have Y₁ U₂ = Y₂ U₁ on each, however
    narrow its resonances and whatever the forces, but for the gain of each channel, which scatters
    with the level by what its data sheet says. What is more than noise, whose squares are an upper
    bound. ``left``: the same of what a model leaves of both. None where few lines are common."""
    _, i, j = np.intersect1d(np.round(a.s, 9), np.round(b.s, 9), return_indices=True)
    if len(i) < LEAST_LINES:
        return None
    (y, u, dy), (z, w, dz) = (
        (s.Y[k, :, 0], s.U[k, 0, 0][:, None], s.std[k, :, 0]) for s, k in ((a, i), (b, j))
    )
    one, other = y * w, z * u
    size = np.sqrt(0.5 * np.sum(np.abs(one) ** 2 + np.abs(other) ** 2))
    noise = np.sqrt(np.sum((dy * np.abs(w)) ** 2 + (dz * np.abs(u)) ** 2))
    gap = one - other
    if left is not None:
        gap = left[0].Y[i, :, 0] * w - left[1].Y[j, :, 0] * u
    power = np.maximum(np.sum(np.abs(other) ** 2, axis=0), np.finfo(float).tiny)
    gain = np.real(np.sum(np.conj(other) * gap, axis=0)) / power
    gap = gap - np.clip(gain, -GAIN, GAIN) * other
    # squares beyond those of noise, and what chance makes of these (chi-square, two a line)
    beyond = np.sqrt(max(float(np.sum(np.abs(gap) ** 2)) - noise**2, 0.0))
    chance = noise * (1.0 / y.size) ** 0.25
    return LevelChange(float(beyond / size), float(chance / size))


def _of_frfs(a: Signal, b: Signal) -> LevelChange | None:
    """Of FRFs on different lines, smoothed; None of time histories, whose transforms depend on
    their length and, smoothed, on the force of the day."""
    return None if np.any(a.s.real) or np.any(b.s.real) else _smoothed(a, b)


def _smoothed(a: Signal, b: Signal) -> LevelChange | None:
    """Under a kernel, where both were forced."""
    low, high = (pick(f(a), f(b)) for pick, f in ((max, _lowest), (min, _highest)))
    if high <= NARROW * low:
        return None
    centres = np.geomspace(low * 1.1, high / 1.1, 60)
    (x, dx), (y, dy) = _transfer(a, centres), _transfer(b, centres)
    size = np.sqrt(np.mean(np.abs(x) ** 2))
    apart = np.sqrt(np.mean(np.abs(x - y) ** 2)) / size
    return LevelChange(float(apart), float(np.sqrt(np.mean(dx**2 + dy**2)) / size))


def _lowest(signal: Signal) -> float:
    return float(signal.s.imag[0] / (2 * np.pi))


def _highest(signal: Signal) -> float:
    return float(signal.s.imag[-1] / (2 * np.pi))


def _transfer(signal: Signal, centres: Real) -> tuple[Complex, Real]:
    """H1 under a kernel of a twentieth of the frequency, and its noise: (points, sensors) each."""
    f = signal.s.imag / (2 * np.pi)
    kernel = (0.05 * centres[:, None]) / (
        (centres[:, None] - f) ** 2 + (0.05 * centres[:, None]) ** 2
    )
    drive = signal.U[:, 0, 0]
    mix = kernel * np.conj(drive) / (kernel @ np.abs(drive) ** 2)[:, None]
    return mix @ signal.Y[:, :, 0], np.sqrt(np.abs(mix) ** 2 @ signal.std[:, :, 0] ** 2)
