"""Which measurement next: the level and the frequency at which two explanations that do alike on
what was recorded foretell the most different responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.motion.runs import Run
from cvxupdate.diagnose.responses.signals import Complex, Signal
from cvxupdate.diagnose.settings import TELLING
from cvxupdate.errors import ModelError
from cvxupdate.physics.units import quantity

LOUDER = (0.25, 0.5, 1.0, 2.0, 4.0)  # times the loudest run that was fitted
WIDTH = 0.02  # of the lines, over which the difference is averaged before its largest is sought


@dataclass(frozen=True)
class Apart:
    """At ``level``, ``factor`` times that of the loudest run, predictions differ by ``difference``
    of the response, most at ``frequency`` (Hz) and ``sensor``; at the loudest run by ``now``."""

    level: float
    factor: float
    difference: float
    frequency: float
    sensor: str
    now: float


def apart(a: Fit, b: Fit, run: Run, signals: Sequence[Signal]) -> Apart:
    """Of two fits with internal forces, by simulation under the force of a run and multiples of it;
    ``signals`` are those of the run. Levels at which springs soften until nothing holds one of the
    two are no advice."""
    tried = []
    for factor in LOUDER:
        try:
            ours, theirs = (_foretold(f, run, signals, factor) for f in (a, b))
        except ModelError:
            break
        off = [np.abs(x - y)[:, :, 0] for x, y in zip(ours, theirs, strict=True)]
        whole = sum(float(np.sum(np.abs(x) ** 2)) for x in (*ours, *theirs)) / 2.0
        size = float(np.sqrt(sum(float(np.sum(d**2)) for d in off) / max(whole, 1e-300)))
        tried.append((size, factor, off))
    now = next(size for size, factor, _ in tried if factor == 1.0)
    size, factor, off = max(tried, key=lambda t: t[0])
    # of each signal the line and the sensor with the largest mean square
    places = [_largest(d, s) for d, s in zip(off, signals, strict=True)]
    _, frequency, sensor = max(places)
    return Apart(run.level * factor, factor, size, frequency, sensor, now)


def _largest(off: np.ndarray, s: Signal) -> tuple[float, float, str]:
    width = max(1, int(WIDTH * len(off)))
    kernel = np.ones(width) / width
    power = np.column_stack([np.convolve(c**2, kernel, mode="same") for c in off.T])
    line, sensor = np.unravel_index(int(np.argmax(power)), power.shape)
    # a signal's own size: of displacement and acceleration neither is to count for more
    part = float(power[line, sensor] / max(float(np.mean(np.abs(s.Y) ** 2)), 1e-300))
    return part, float(s.s[line].imag / (2.0 * np.pi)), s.sensors[int(sensor)]


def _foretold(fit: Fit, run: Run, signals: Sequence[Signal], factor: float) -> tuple[Complex, ...]:
    setting = fit.setting.on([replace(s, U=factor * s.U) for s in signals])
    louder = replace(run, force=factor * run.force)
    point = replace(setting, runs={**setting.runs, run.name: louder}).evaluate(fit.p)
    modelled: tuple[Complex, ...] = point.modelled()
    return modelled


def next_measurement(
    runs: Mapping[str, Run],
    signals: Sequence[Signal],
    fits: tuple[Fit, Fit],
    titles: tuple[str, str],
) -> str:
    """What would tell two fits apart, on the loudest run with ``signals``, in words."""
    run = max((runs[s.name] for s in signals), key=lambda r: r.level)
    own = [s for s in signals if s.name == run.name]
    return told(apart(*fits, run, own), *titles)


def told(found: Apart, ours: str, theirs: str) -> str:
    """In words; empty where no level would tell them apart either."""
    if found.difference < TELLING:
        return ""
    share = f"{100.0 * found.difference:.2g} % of the response"
    where = f"most at {found.sensor} around {quantity(found.frequency, 'Hz')}"
    if found.factor == 1.0:
        level = f"the level that was recorded ({found.level:.3g}) with less noise"
        return f"To tell {ours} from {theirs}, measure at {level}: they differ by {share}, {where}."
    return (
        f"To tell {ours} from {theirs}, measure at level {found.level:.3g} ({found.factor:g} times "
        f"the loudest run): there they differ by {share}, {where}; in the loudest run by "
        f"{100.0 * found.now:.2g} %."
    )
