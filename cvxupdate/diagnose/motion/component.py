"""A part on a test rig: its motion is imposed and its force measured, with no structure around. Its
law is a regression of the force on columns along the recorded motion (Masri and Caughey 1979).

Runs at several levels (band tension, amplitude) share the shape of a law; its coefficients are
shared too, or each level has its own, and what was held out at a level between is interpolated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.optimize import nnls
from scipy.signal import savgol_filter

from cvxupdate.diagnose.responses.signals import Real
from cvxupdate.diagnose.settings import OWN_GAIN
from cvxupdate.fe.model import Model
from cvxupdate.forces import (
    contact_columns,
    cubic_column,
    friction_column,
    jenkins_columns,
    quadratic_column,
)
from cvxupdate.recordings.types import Recording, TimeHistory

SMOOTHED = 9  # samples of the parabola that gives the velocity
MOST = 6000  # samples of a run that are fitted: of more, evenly chosen ones
SLOW = 0.01  # of the largest velocity: width of the sign of friction
SLIPS = np.geomspace(0.01, 0.6, 8)  # of the largest motion: distance to slip
PLAYS = np.linspace(0.0, 0.8, 9)  # of the largest motion: free play
SLIDERS = ("jenkins", "jenkins with play")
FINER = (0.5, 0.25, 0.12)  # steps of the search beyond the grids, in parts of a slip and of a play

Shape = tuple[float, ...]


@dataclass(frozen=True)
class Rig:
    """One run: motion ``x`` (m), velocity ``v`` and measured ``force`` (N), (samples,) each, at a
    drive ``level`` (0: none is stated)."""

    name: str
    use: str
    label: str
    x: Real
    v: Real
    force: Real
    level: float = 0.0

    @cached_property
    def chosen(self) -> slice:
        """Samples that are fitted."""
        return slice(None, None, max(1, len(self.x) // MOST))


@dataclass(frozen=True)
class Law:
    """A law with its figures.

    ``name`` of a family, its ``shape`` (slip distance and play in m, or a gap); ``own``: for each
    level that has coefficients of its own (one where they are shared) the level, those of spring
    and dashpot beside it, and that of its column; relative ``errors`` on what was fitted and held
    out (NaN: nothing was)."""

    name: str
    shape: Shape
    own: tuple[tuple[float, float, float, float], ...]
    errors: tuple[float, float]

    def at(self, level: float) -> tuple[float, float, float]:
        """(k, c, size) at a level, between those that were fitted by interpolation."""
        levels, *values = np.array(self.own).T
        k, c, size = (float(np.interp(level, levels, v)) for v in values)
        return k, c, size

    @property
    def size(self) -> float:
        """Coefficient of its column, at the highest level."""
        return self.own[-1][3]

    @property
    def k(self) -> float:
        """Of the spring beside it, N/m, at the highest level."""
        return self.own[-1][1]

    @property
    def c(self) -> float:
        """Of the dashpot beside it, N·s/m, at the highest level."""
        return self.own[-1][2]

    @property
    def travel(self) -> float:
        """Of sliders: how far it moves after a reversal until half of the force acts the other way,
        m: its spring lets go, the play is crossed, the spring is bent by half."""
        return self.shape[1] + 1.5 * self.shape[0]


def rigs_of(model: Model, recordings: Sequence[Recording]) -> list[Rig]:
    """The runs of a part: of a model without mass or without stiffness, with a displacement and a
    force at one DOF."""
    if model.total_mass() > 0.0 and np.any(model.matrices().K.data != 0.0):
        return []
    out = []
    for r in recordings:
        if not isinstance(r, TimeHistory):
            return []
        forces = {c.label: i for i, c in enumerate(r.channels) if c.quantity == "force"}
        moved = [
            (c.label, i)
            for i, c in enumerate(r.channels)
            if c.quantity == "displacement" and c.label in forces
        ]
        if len(moved) != 1:
            return []
        label, at = moved[0]
        x, force = r.data[:, at], r.data[:, forces[label]]
        v = savgol_filter(x, SMOOTHED, 2, deriv=1, delta=1.0 / r.rate)
        level = r.origin.level or 0.0
        out.append(Rig(r.origin.name, r.origin.use, label, x, v, force, level))
    return out


def laws_of(rigs: Sequence[Rig], own: bool = False) -> list[Law]:
    """Every family, fitted; the best linear one first. ``own``: each level has its own
    coefficients."""
    fit = [r for r in rigs if r.use == "fit"]
    far = max(float(np.percentile(np.abs(r.x), 99.9)) for r in fit)
    make = partial(fitted, rigs, own=own)
    out = [make("linear", ())]
    out += [make(name, ()) for name in ("cubic", "quadratic", "friction")]
    gaps = [make("clearance", (g,)) for g in far * PLAYS[1:]]
    out.append(min(gaps, key=lambda w: w.errors[0]))
    for name, plays in (("jenkins", PLAYS[:1]), ("jenkins with play", PLAYS)):
        tried = [make(name, (s, p)) for s in far * SLIPS for p in far * plays]
        out.append(_refined(make, min(tried, key=lambda w: w.errors[0]), far, len(plays) > 1))
    return out


def of_levels(rigs: Sequence[Rig]) -> tuple[list[Law], bool]:
    """`laws_of`, and whether each level has coefficients of its own: where the best law is by so
    much better with them that noise does not do it."""
    shared = laws_of(rigs)
    if len({r.level for r in rigs if r.use == "fit"}) < 2:
        return shared, False
    each = laws_of(rigs, own=True)
    best, free = (min(law.errors[0] for law in laws) for laws in (shared, each))
    return (each, True) if free < OWN_GAIN * best else (shared, False)


def _refined(make: Callable[[str, Shape], Law], law: Law, far: float, play: bool) -> Law:
    for step in FINER:
        slip, free = law.shape
        width = far * (PLAYS[1] - PLAYS[0]) * step if play else 0.0
        tried = [
            make(law.name, (slip * a, max(free + b, 0.0)))
            for a in (1.0 / (1.0 + step), 1.0, 1.0 + step)
            for b in ((-width, 0.0, width) if play else (0.0,))
        ]
        law = min([law, *tried], key=lambda w: w.errors[0])
    return law


def fitted(rigs: Sequence[Rig], name: str, shape: Shape, own: bool = False) -> Law:
    """Coefficients that are not negative, an offset of each run beside them; sliders alone, for a
    dashpot beside would take part of their force."""
    fit = [r for r in rigs if r.use == "fit"]
    levels = sorted({r.level for r in fit}) if own else [fit[0].level]
    rows = [
        (level, *_coefficients([r for r in fit if not own or r.level == level], name, shape))
        for level in levels
    ]
    law = Law(name, shape, tuple(rows), (np.nan, np.nan))
    return replace(law, errors=(error(rigs, law, "fit"), error(rigs, law, "hold-out")))


def _coefficients(rigs: Sequence[Rig], name: str, shape: Shape) -> tuple[float, float, float]:
    """(k, c, size) of all runs given, by least squares."""
    columns = [_columns(r, name, shape)[r.chosen] for r in rigs]
    A = np.vstack([own - own.mean(axis=0) for own in columns])
    b = np.concatenate([f - f.mean() for f in (r.force[r.chosen] for r in rigs)])
    scale = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    found = nnls(A / scale, b)[0] / scale
    if name in SLIDERS:
        found = np.array([0.0, 0.0, found[0]])
    k, c, size = (float(x) for x in np.append(found, 0.0)[:3])
    return k, c, size


def force_of(r: Rig, law: Law) -> Real:
    """The law's force along a run, its mean that of the measured one."""
    own = _own_force(r, law)
    return np.asarray(own - own.mean() + r.force.mean())


def centre(r: Rig, law: Law) -> float:
    """Of the loops of a run: what the load cell reads where the law's force is zero, N."""
    return float(np.mean(r.force - _own_force(r, law)))


def _own_force(r: Rig, law: Law) -> Real:
    k, c, size = law.at(r.level)
    sizes = [size] if law.name in SLIDERS else [k, c, size]
    columns = _columns(r, law.name, law.shape)
    return np.asarray(columns @ np.array(sizes[: columns.shape[1]]))


def error(rigs: Sequence[Rig], law: Law, use: str) -> float:
    """‖f − f̂‖ / ‖f‖ without means, of all runs of a use; NaN without any."""
    own = [r for r in rigs if (r.use == "fit") == (use == "fit")]
    if not own:
        return float("nan")
    gap = sum(float(np.sum((force_of(r, law) - r.force) ** 2)) for r in own)
    return float(np.sqrt(gap / sum(float(np.sum((r.force - r.force.mean()) ** 2)) for r in own)))


def _columns(r: Rig, name: str, shape: Shape) -> Real:
    x, v = r.x[:, None], r.v[:, None]
    both = [x, v]
    match name:
        case "cubic":
            both.append(cubic_column(x)[..., 0])
        case "quadratic":
            both.append(quadratic_column(v)[..., 0])
        case "friction":
            both.append(friction_column(v, SLOW * float(np.abs(v).max()))[..., 0])
        case "clearance":
            both.append(contact_columns(x, shape[0], True)[..., 0])
        case "jenkins" | "jenkins with play":
            both.append(jenkins_columns(x, shape[0], shape[1])[..., 0])
    return np.hstack(both[2:] if name in SLIDERS else both)
