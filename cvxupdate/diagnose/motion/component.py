"""A part on a test rig: its motion is imposed and its force measured, with no structure around. Its
law is a regression of the force on columns along the recorded motion (Masri and Caughey 1979)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import nnls
from scipy.signal import savgol_filter

from cvxupdate.diagnose.responses.signals import Real
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


@dataclass(frozen=True)
class Rig:
    """One run: motion ``x`` (m), velocity ``v`` and measured ``force`` (N), (samples,) each."""

    name: str
    use: str
    label: str
    x: Real
    v: Real
    force: Real

    @cached_property
    def chosen(self) -> slice:
        """Samples that are fitted."""
        return slice(None, None, max(1, len(self.x) // MOST))


@dataclass(frozen=True)
class Law:
    """A law with its figures.

    ``name`` of a family, its ``shape`` (slip distance and play in m, or a gap), coefficients
    ``size`` of its column and ``k``, ``c`` of spring and dashpot beside it; relative ``errors`` on
    what was fitted and held out (NaN: nothing was)."""

    name: str
    shape: tuple[float, ...]
    size: float
    k: float
    c: float
    errors: tuple[float, float]

    @property
    def travel(self) -> float:
        """Of sliders: how far it moves after a reversal until half of the force acts the other way,
        m: its spring lets go, the play is crossed, the spring is bent by half."""
        return self.shape[1] + 1.5 * self.shape[0]


def rigs_of(model: Model, recordings: Sequence[Recording]) -> list[Rig]:
    """The runs of a part, all in one state: of a model without mass or without stiffness, with a
    displacement and a force at one DOF."""
    if model.total_mass() > 0.0 and np.any(model.matrices().K.data != 0.0):
        return []
    if len({r.origin.level for r in recordings}) > 1:
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
        out.append(Rig(r.origin.name, r.origin.use, label, x, v, force))
    return out


def laws_of(rigs: Sequence[Rig]) -> list[Law]:
    """Every family, fitted; the best linear one first."""
    fit = [r for r in rigs if r.use == "fit"]
    far = max(float(np.percentile(np.abs(r.x), 99.9)) for r in fit)
    out = [fitted(rigs, "linear", ())]
    out += [fitted(rigs, name, ()) for name in ("cubic", "quadratic", "friction")]
    gaps = [fitted(rigs, "clearance", (g,)) for g in far * PLAYS[1:]]
    out.append(min(gaps, key=lambda w: w.errors[0]))
    for name, plays in (("jenkins", PLAYS[:1]), ("jenkins with play", PLAYS)):
        tried = [fitted(rigs, name, (s, p)) for s in far * SLIPS for p in far * plays]
        out.append(_refined(rigs, min(tried, key=lambda w: w.errors[0]), far, len(plays) > 1))
    return out


def _refined(rigs: Sequence[Rig], law: Law, far: float, play: bool) -> Law:
    for step in FINER:
        slip, free = law.shape
        width = far * (PLAYS[1] - PLAYS[0]) * step if play else 0.0
        tried = [
            fitted(rigs, law.name, (slip * a, max(free + b, 0.0)))
            for a in (1.0 / (1.0 + step), 1.0, 1.0 + step)
            for b in ((-width, 0.0, width) if play else (0.0,))
        ]
        law = min([law, *tried], key=lambda w: w.errors[0])
    return law


def fitted(rigs: Sequence[Rig], name: str, shape: tuple[float, ...]) -> Law:
    """Coefficients that are not negative, an offset of each run beside them; sliders alone, for a
    dashpot beside would take part of their force."""
    law = Law(name, shape, 0.0, 0.0, 0.0, (np.nan, np.nan))
    rows, right = [], []
    for r in rigs:
        if r.use == "fit":
            own = _columns(r, law)[r.chosen]
            rows.append(own - own.mean(axis=0))
            right.append(r.force[r.chosen] - r.force[r.chosen].mean())
    A, b = np.vstack(rows), np.concatenate(right)
    scale = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    found = nnls(A / scale, b)[0] / scale
    if name in SLIDERS:
        found = np.array([0.0, 0.0, found[0]])
    k, c, size = (float(x) for x in np.append(found, 0.0)[:3])
    law = replace(law, k=k, c=c, size=size)
    return replace(law, errors=(error(rigs, law, "fit"), error(rigs, law, "hold-out")))


def force_of(r: Rig, law: Law) -> Real:
    """The law's force along a run, its mean that of the measured one."""
    sizes = [law.size] if law.name in SLIDERS else [law.k, law.c, law.size]
    columns = _columns(r, law)
    own = columns @ np.array(sizes[: columns.shape[1]])
    return np.asarray(own - own.mean() + r.force.mean())


def error(rigs: Sequence[Rig], law: Law, use: str) -> float:
    """‖f − f̂‖ / ‖f‖ without means, of all runs of a use; NaN without any."""
    own = [r for r in rigs if (r.use == "fit") == (use == "fit")]
    if not own:
        return float("nan")
    gap = sum(float(np.sum((force_of(r, law) - r.force) ** 2)) for r in own)
    return float(np.sqrt(gap / sum(float(np.sum((r.force - r.force.mean()) ** 2)) for r in own)))


def _columns(r: Rig, law: Law) -> Real:
    x, v = r.x[:, None], r.v[:, None]
    both = [x, v]
    match law.name:
        case "cubic":
            both.append(cubic_column(x)[..., 0])
        case "quadratic":
            both.append(quadratic_column(v)[..., 0])
        case "friction":
            both.append(friction_column(v, SLOW * float(np.abs(v).max()))[..., 0])
        case "clearance":
            both.append(contact_columns(x, law.shape[0], True)[..., 0])
        case "jenkins" | "jenkins with play":
            both.append(jenkins_columns(x, law.shape[0], law.shape[1])[..., 0])
    return np.hstack(both[2:] if law.name in SLIDERS else both)
