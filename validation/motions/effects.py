"""What is concealed: an internal force whose size is drawn from how far, how fast and against how
much stiffness its place moves without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.motions.laws import Law
from validation.rigs.drawing import Drawing, Generator
from validation.rigs.effects import Truth, also, near, place
from validation.rigs.families import between, figures

Real = NDArray[np.float64]
Row = Mapping[str, Any]
STIFF, FORCE, WEAK = 0.3, 0.2, 0.5  # relative errors of sizes that are right
GAP = 0.15  # of the motion or of the gap
EVEN = "even"  # the figure of a force in x²; in x³ it is "k3"
RUB = 2e-3  # of the r.m.s. velocity at a place: where friction turns over
WORDS = (
    "cubic_stiffness",
    "clearance",
    "dry_friction",
    "hysteresis",
    "quadratic_damping",
)


@dataclass(frozen=True)
class Spot:
    """A place: ``nodes`` (one: to ground), ``dof``; peak motion ``x`` (m) and velocity ``v`` (m/s)
    at the middle level without the effect; its own stiffness ``k`` (N/m)."""

    nodes: tuple[int, ...]
    dof: str
    x: float
    v: float
    k: float


Made = tuple[Law, Truth]


def _truth(
    d: Drawing,
    s: Spot,
    physics: str,
    figures_of: Sequence[tuple[str, float, float]],
    others: Sequence[tuple[str, str]],
    verdicts: tuple[str, ...] = ("missing_physics",),
) -> Truth:
    where = place(s.nodes, dof=s.dof)
    words = tuple(also(name, where, grade) for name, grade in others)
    return Truth(physics, where, tuple(figures_of), (), near(d, s.nodes), words, verdicts)


def cubic(rng: Generator, d: Drawing, s: Spot) -> Made:
    """Hardening, one in four softening: 2 to 100 % of its place's stiffness at the peak."""
    soft = rng.random() < 0.25
    part = -between(rng, 0.02, 0.05) if soft else between(rng, 0.05, 1.0)
    k3 = figures(part * s.k / s.x**2)
    words = [("clearance", "part")]
    known = [("k3", k3, STIFF * abs(k3))]
    return Law("cubic", (k3,)), _truth(d, s, "cubic_stiffness", known, words)


def gap(rng: Generator, d: Drawing, s: Spot) -> Made:
    """A stop on one side."""
    far, k = figures(s.x * rng.uniform(0.3, 0.8)), figures(s.k * between(rng, 0.3, 5.0))
    side = 1.0 if rng.random() < 0.5 else -1.0
    known = [("gap", side * far, GAP * far), ("k", k, STIFF * k)]
    words = [("cubic_stiffness", "part")]
    return Law("gap", (k, far, side)), _truth(d, s, "clearance", known, words)


def stops(rng: Generator, d: Drawing, s: Spot) -> Made:
    """A stop on either side."""
    far, k = figures(s.x * rng.uniform(0.3, 0.8)), figures(s.k * between(rng, 0.3, 5.0))
    known = [("gap", far, GAP * far), ("k", k, STIFF * k)]
    words = [("cubic_stiffness", "part")]
    return Law("play", (k, far)), _truth(d, s, "clearance", known, words)


def bilinear(rng: Generator, d: Drawing, s: Spot) -> Made:
    """Stiffer to one side from rest on, as a crack that closes: a stop without a gap."""
    k, side = figures(s.k * between(rng, 0.15, 1.0)), 1.0 if rng.random() < 0.5 else -1.0
    known = [("gap", 0.0, GAP * s.x), ("k", k, STIFF * k)]
    return Law("gap", (k, 0.0, side)), _truth(d, s, "clearance", known, [])


def friction(rng: Generator, d: Drawing, s: Spot) -> Made:
    """What gives a mode about 1 to 10 % of critical damping at the middle level."""
    limit = figures(between(rng, 0.01, 0.1) * np.pi * s.k * s.x / 2.0)
    known = [("force", limit, FORCE * limit)]
    words = [("hysteresis", "right"), ("viscous_damper", "part")]
    return Law("friction", (limit,), RUB * s.v), _truth(d, s, "dry_friction", known, words)


def _memory(kind: str, rng: Generator, d: Drawing, s: Spot) -> Made:
    k = figures(s.k * between(rng, 0.1, 1.0))
    limit = figures(k * s.x * between(rng, 0.05, 0.4))
    known = [("k", k, STIFF * k), ("force", limit, 1.25 * FORCE * limit)]
    words = [("dry_friction", "part"), ("viscous_damper", "part")]
    return Law(kind, (k, limit)), _truth(d, s, "hysteresis", known, words)


def jenkins(rng: Generator, d: Drawing, s: Spot) -> Made:
    """A spring behind a slider."""
    return _memory("jenkins", rng, d, s)


def bouc_wen(rng: Generator, d: Drawing, s: Spot) -> Made:
    """A slider that gives way gradually."""
    return _memory("bouc_wen", rng, d, s)


def damping(rng: Generator, d: Drawing, s: Spot) -> Made:
    """With the square of the velocity: 1 to 12 % of critical damping at the middle level."""
    c2 = figures(2.0 * between(rng, 0.01, 0.12) * s.k * s.x / s.v**2)
    known = [("c2", c2, STIFF * c2)]
    words = [("viscous_damper", "part")]
    return Law("damping", (c2,)), _truth(d, s, "quadratic_damping", known, words)


def quadratic(rng: Generator, d: Drawing, s: Spot) -> Made:
    """A spring that stiffens to one side, whose force goes with x². In words for other springs it
    is told in part."""
    k2 = figures(between(rng, 0.05, 0.15) * s.k / s.x)
    known = [(EVEN, k2, STIFF * k2)]
    words = [("clearance", "part")]
    return Law("quadratic", (k2,)), _truth(d, s, "cubic_stiffness", known, words)


MAKERS: dict[str, Callable[[Generator, Drawing, Spot], Made]] = {
    "cubic": cubic,
    "gap": gap,
    "stops": stops,
    "bilinear": bilinear,
    "friction": friction,
    "jenkins": jenkins,
    "bouc_wen": bouc_wen,
    "quadratic_damping": damping,
    "quadratic_spring": quadratic,
}
OFTEN = ("cubic", "gap", "stops", "friction", "jenkins")  # twice as often as the others


def graded(f: Row, truth: Row, groups: Mapping[str, Sequence[int]]) -> str | None:
    """How well a finding names an internal force: the same nodes and direction are right; some of
    them, or nodes beside them, are part. Linear effects go by the rules of rigs."""
    from validation.rigs import judge

    if truth["physics"] not in WORDS:
        return judge.graded(f, truth, groups)
    words = {truth["physics"]: judge.RIGHT} | {x["physics"]: x["grade"] for x in truth["also"]}
    if f["physics"] not in words:
        return None
    nodes, true = set(f["location"].get("nodes") or ()), set(truth["location"]["nodes"])
    dof = f["location"].get("dof")
    if not nodes or (dof and dof != truth["location"]["dof"]):
        return None
    if nodes == true:
        squares = [EVEN in p for p in (f["parameters"], {q["name"] for q in truth["parameters"]})]
        other = f["physics"] == "cubic_stiffness" == truth["physics"] and len(set(squares)) > 1
        return judge.PART if other else str(words[f["physics"]])  # x² for x³, or the reverse
    return judge.PART if nodes <= true | set(truth["near"]["nodes"]) else None
