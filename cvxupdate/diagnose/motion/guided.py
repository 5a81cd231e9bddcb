"""Internal forces along the motion that the sensors say, in place of the simulated one: fits that
find their way to where free simulation can take over.

What a simulation misses in its first periods grows until model and structure are out of step, and
output error has as many minima as there are periods; with the forces along the smoothed motion
(`smoother`) it has hardly more than a linear structure (equation error; Ljung 1999, 10.5). The
coefficients are a little biased there, so that it is only where a fit begins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.fit import Fit, fitted, fitted_at
from cvxupdate.diagnose.motion.rates import STEP, stepped_figures
from cvxupdate.diagnose.motion.runs import COLUMNS, beginning
from cvxupdate.diagnose.motion.smoother import Beyond
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.responses.signals import Real, Signal
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.internal import internal_forces
from cvxupdate.forces import Laws
from cvxupdate.recordings.measured import DECAY
from cvxupdate.update.trust_region import Options

GUIDED = Options(1e-2, 8, 0.5)  # how it is fitted: where a fit begins, nothing finer counts
SHORTER = (8.0, 4.0, 2.0)  # times as steep as the window of the records: first fits in simulation
SETTLING = 3  # how often the motion is smoothed anew with the laws' forces
Motions = Mapping[str, tuple[Real, Real, Real]]


def begun(setting: Any, start: Real, smooth: Sequence[Signal]) -> Real:
    """Where the fit of a `MotionSetting` with laws is to begin instead of ``start``: fitted to the
    smoothest signals (none: not at all) along the motion that the sensors say, then, where its own
    signals are not smoothed, in simulation from the beginning of the records on; if simulation
    leaves less there."""
    count = len(setting.model.parameters)
    if not internal_forces(setting.model, start[:count]).laws.size:
        return start
    found = start
    try:
        if smooth:
            found = fitted(replace(setting.on(smooth), guided=True), start, GUIDED).p
        if all(s.mix is None for s in setting.signals):
            starts = (start,) if found is start else (start, found)
            found = lengthened(setting, starts)[-1].p
        there = fitted_at(setting, found).cost
    except CvxupdateError:
        return start
    return found if there <= fitted_at(setting, start).cost else start


def lengthened(setting: Any, starts: Sequence[Real]) -> list[Fit]:
    """Fits to more and more of the records (`SHORTER`), from the better of ``starts`` on. Where
    parts touch, motions that begin nearly alike may part exponentially; the derivative of what
    comes after counts for nothing then, and leads nowhere, however near the truth is. Under a
    window that falls faster than they part there is one (progressive fits of chaotic motion; Voss,
    Timmer and Kurths 2004)."""
    out: list[Fit] = []
    for times in SHORTER:
        early = [beginning(s, setting.runs[s.name], times * DECAY) for s in setting.signals]
        stage = setting.on(early)
        start = out[-1].p if out else min(starts, key=lambda p: fitted_at(stage, p).cost)
        out.append(fitted(stage, start, EFFORTS["coarse"]))
    return out


def guided_motions(point: Any) -> Motions:
    """Of every run the internal forces of a `MotionPoint`, and the smoothed motions and velocities
    of their places (samples on the clock of the regression, places)."""
    laws, B = point.forces
    out = {}
    for name in dict.fromkeys(s.name for s in point.setting.signals):
        run = point.setting.runs[name]
        beyond = Beyond.alone(point, run)
        out[name] = _smoothed(beyond, laws, B.T @ point.modes.shapes)
    return out


def _smoothed(beyond: Beyond, laws: Laws, shapes: Real) -> tuple[Real, Real, Real]:
    """One place after the other, the forces at the others as they are; ``shapes`` (places, modes)
    of the directions."""
    run = beyond.run
    x, v, f = (np.zeros((COLUMNS * run.samples, len(shapes))) for _ in range(3))
    places = [beyond.smoother(shape) for shape in shapes]  # before other places act
    for again in range(SETTLING if len(shapes) else 0):
        acting = -run.coarse(f)
        for k, shape in enumerate(shapes):
            place = places[k]
            if again and len(shapes) > 1:
                rest = np.delete(acting, k, axis=1) @ np.delete(shapes, k, axis=0)
                place = beyond.under(rest).smoother(shape)
            if again:
                x[:, k], v[:, k] = place.settled(f[:, k], x[:, k], v[:, k])
            else:
                x[:, k], v[:, k] = place.motion()
        f = _forces(laws, x, v)
    return f, x, v


def _forces(laws: Laws, x: Real, v: Real) -> Real:
    return np.asarray(laws.trace(x, v)[0], dtype=float)


def guided_rates(point: Any) -> tuple[list[int], Mapping[str, Real]]:
    """Unknowns of a `MotionPoint` that are the laws' own, and by how much they move the internal
    forces along the motion that is given: of every run (samples, places, unknowns)."""
    laws, _ = point.forces
    moved = {
        j: replace(laws, values=figures)
        for j, figures in stepped_figures(point)
        if not np.array_equal(figures, laws.values)
    }
    out = {}
    for name, (f, x, v) in point.motions.items():
        rates = [(_forces(other, x, v) - f) / STEP for other in moved.values()]
        out[name] = np.stack(rates, axis=-1) if rates else np.zeros((*f.shape, 0))
    return list(moved), out
