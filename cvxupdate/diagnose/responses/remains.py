"""Where in frequency, and at which sensors, is what a model leaves of the responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.responses.errors import on_signals
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Real, Signal
from cvxupdate.diagnose.settings import MOSTLY, SPREAD
from cvxupdate.physics.place import listed

SENSORS = 3  # that are named


def remains(point: ResponsePoint, signals: Sequence[Signal]) -> str:
    """The narrowest band that holds most of what is left beyond noise, and the sensors that have
    most of it, in words; empty where noise is all. Every channel counts alike: squares are parts of
    its own power."""
    lines: list[Real] = []
    energy: list[Real] = []
    own: dict[str, float] = {}
    for signal, model in zip(signals, on_signals(point, signals).modelled(), strict=True):
        power = np.sum(np.abs(signal.Y) ** 2, axis=(0, 2), keepdims=True)
        left = (np.abs(model - signal.Y) ** 2 - signal.std**2) / np.maximum(power, 1e-300)
        left[:, ~signal.audible()] = 0.0
        lines.append(signal.s.imag / (2.0 * np.pi))
        energy.append(left.sum(axis=(1, 2)))
        for label, part in zip(signal.sensors, left.sum(axis=(0, 2)), strict=True):
            own[label] = own.get(label, 0.0) + max(float(part), 0.0)
    f, e = np.concatenate(lines), np.concatenate(energy)
    if e.sum() <= 0.0:
        return ""
    low, high = _band(f, e)
    top, bottom = float(f.max()), max(float(f.min()), 1e-3 * float(f.max()))
    spread = high - low > SPREAD * (top - bottom) or high > low * (top / bottom) ** SPREAD
    band = f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"
    where = "spread over the band" if spread else f"mostly at {band} Hz"
    return f"What is left is {where}{_sensors(own)}."


def _band(f: Real, energy: Real) -> tuple[float, float]:
    """The narrowest band, by its ratio, that holds `MOSTLY` of the energy; noise may make that of a
    line negative."""
    order = np.argsort(f, kind="stable")
    f = f[order]
    total = np.concatenate([[0.0], np.cumsum(np.maximum(energy[order], 0.0))])
    ends = np.searchsorted(total, total[:-1] + MOSTLY * total[-1] * (1.0 - 1e-12))
    start = np.flatnonzero(ends <= len(f))
    low, high = np.maximum(f[start], 1e-12), f[ends[start] - 1]
    best = int(np.argmin(high / low))
    return float(low[best]), float(high[best])


def _sensors(own: dict[str, float]) -> str:
    """Those that have twice their share, where together they have most."""
    whole = max(sum(own.values()), 1e-300)
    most = [
        k for k, v in sorted(own.items(), key=lambda item: -item[1]) if v * len(own) > 2 * whole
    ]
    if not most or sum(own[k] for k in most) < MOSTLY * whole:
        return ""
    return f", at {listed(most, SENSORS)}"
