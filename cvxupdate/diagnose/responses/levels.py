"""Whether the recordings depend on the drive level."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.diagnose.types import LevelChange


def level_change(signals: Sequence[Signal]) -> LevelChange | None:
    """The largest change of the transfer function between runs at two drive levels; None where no
    two levels compare.

    A record that starts from rest gives H(s) = Y(s) / U(s) at every s without averaging, so two
    runs of one linear structure agree to noise.
    """
    changes: list[LevelChange] = []
    single = [s for s in signals if s.single and s.level is not None]
    for i, a in enumerate(single):
        for b in single[i + 1 :]:
            if a.level == b.level or a.inputs != b.inputs or a.sensors != b.sensors:
                continue
            changes.append(_between(a, b))
    return max(changes, key=lambda c: c.change, default=None)


def state_change(before: Sequence[Signal], after: Sequence[Signal]) -> LevelChange | None:
    """The largest change of the transfer function from one state of a structure to another, of
    signals with the same channels; None where there are none."""
    alike = [
        (a, b)
        for a in before
        for b in after
        if (a.single and b.single) and (a.inputs, a.sensors) == (b.inputs, b.sensors)
    ]
    return max((_between(a, b) for a, b in alike), key=lambda c: c.change, default=None)


def _between(a: Signal, b: Signal) -> LevelChange:
    n = min(len(a.s), len(b.s))
    (x, dx), (y, dy) = _transfer(a, n), _transfer(b, n)
    size = np.sqrt(np.mean(np.abs(x) ** 2))
    change = np.sqrt(np.mean(np.abs(x - y) ** 2)) / size
    return LevelChange(float(change), float(np.sqrt(np.mean(dx**2 + dy**2)) / size))


def _transfer(signal: Signal, n: int) -> tuple[Complex, Real]:
    """H1 under a kernel of a twentieth of the frequency, and its noise: (points, sensors) each."""
    f = signal.s.imag[:n] / (2 * np.pi)
    centres = np.geomspace(f[0] * 1.1, f[-1] / 1.1, 60)
    kernel = (0.05 * centres[:, None]) / (
        (centres[:, None] - f) ** 2 + (0.05 * centres[:, None]) ** 2
    )
    drive = signal.U[:n, 0, 0]
    mix = kernel * np.conj(drive) / (kernel @ np.abs(drive) ** 2)[:, None]
    return mix @ signal.Y[:n, :, 0], np.sqrt(np.abs(mix) ** 2 @ signal.std[:n, :, 0] ** 2)
