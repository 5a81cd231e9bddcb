"""Linear explanations and the level: no level tells one from another, but it tells each from the
laws that look like it at one level.

At one level of excitation a law of the displacement or the velocity is an equivalent spring or
dashpot (its describing function): ¾ k₃ A² of a cubic spring, 8/(3π) c₂ ωA of a force in |v|v,
4F/(πωA) of dry friction, A being the amplitude there (Gelb and Vander Velde 1968). Under random
forces the factors differ and the powers of A are the same. To first order A goes with the level.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.apart.measurement import LawCheck
from cvxupdate.diagnose.apart.responses import Points, Responses, total
from cvxupdate.diagnose.apart.worth import Products
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.settings import LEVEL_CHANGE
from cvxupdate.diagnose.types import Evidence, Key, Real
from cvxupdate.errors import CvxupdateError, ModelError
from cvxupdate.physics import effect_types
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import capital

FACTORS = (0.25, 0.5, 2.0, 4.0)  # times the level that was recorded


@dataclass(frozen=True)
class Alike:
    """A law that one figure of an effect may be the equivalent of at one level, and the power of
    the level with which that figure then goes."""

    physics: str
    figure: str
    power: float


SPRING = (Alike("cubic_stiffness", "k", 2.0),)
LAWS = {
    "grounding_spring": SPRING,
    "joint_flexibility": SPRING,
    "viscous_damper": (
        Alike("quadratic_damping", "c", 1.0),
        Alike("dry_friction", "c", -1.0),
    ),
}


@dataclass(frozen=True)
class Twin:
    """An ``effect`` of a fitted ``hypothesis`` as the equivalent of a ``law``; ``index`` of its
    unknown among all, ``sizes`` (factors,) of that unknown at each of `FACTORS`."""

    hypothesis: Hypothesis
    effect: Effect
    law: Alike
    index: int
    sizes: tuple[float, ...]

    def at(self, size: float) -> Real:
        """The unknowns with that one at a size."""
        p = self.hypothesis.fit.p.copy()
        p[self.index] = size
        return p

    def check(self, separations: Sequence[float]) -> LawCheck:
        """With the deviations at each factor."""
        nouns = {t.name: t.noun for t in effect_types()}
        noun = nouns[self.law.physics]
        return LawCheck(
            capital(self.effect.title), noun, self.law.power, FACTORS, tuple(separations)
        )


def twins(hypotheses: Sequence[Hypothesis]) -> Iterator[Twin]:
    """Of every effect that not all explanations share and that may be a law's equivalent."""
    shared = frozenset.intersection(*(h.keys for h in hypotheses))
    done: set[Key] = set()
    for h in hypotheses:
        model = h.fit.setting.model
        at = len(model.parameters) - sum(e.columns for e in h.effects)
        for e in h.effects:
            for law in LAWS.get(e.physics, ()) if e.key not in shared | done else ():
                sizes = _sizes(h, e, at, law)
                if sizes is not None:
                    yield Twin(h, e, law, at + _figure(e, law), sizes)
            done.add(e.key)
            at += e.columns


def _figure(e: Effect, law: Alike) -> int:
    return next((q.index for q in e.figures if q.name == law.figure), 0)


def _sizes(h: Hypothesis, e: Effect, at: int, law: Alike) -> tuple[float, ...] | None:
    """Unknowns at which the figure is what the law makes of it at each factor; None where the
    effect has no such figure. A figure, or what it is the inverse of, is affine in its unknown."""
    found = [q for q in e.figures if q.name == law.figure]
    if len(found) != 1 or not e.columns:
        return None
    model, q = h.fit.setting.model, found[0]
    parameter = model.parameters[at + q.index]
    x = float(h.fit.p[at + q.index])
    inverse = q.nothing is None  # a compliance is what is fitted
    now, none = (q.value(model, parameter, v, 0.0)[0] for v in (x, 0.0))
    if inverse:
        now, none = 1.0 / now, 1.0 / none
    if not np.isfinite([now, none]).all() or abs(now - none) <= 1e-12 * abs(now):
        return None
    powers = [f ** (-law.power if inverse else law.power) for f in FACTORS]
    sizes = ((power * now - none) / (now - none) * x for power in powers)
    return tuple(max(s, 0.0) if inverse else s for s in sizes)


def checks_of_responses(asked: Sequence[Responses]) -> list[LawCheck]:
    """The same responses at other levels: by how many deviations they tell each linear effect from
    a law that it may be the equivalent of."""
    out = []
    for r in asked:
        members = r.question.members
        for twin in twins(members) if len(members) > 1 else ():
            k = next(k for k, h in enumerate(members) if h is twin.hypothesis)
            out.append(twin.check([_told(r, k, twin, size) for size in twin.sizes]))
    return out


def _told(r: Responses, k: int, twin: Twin, size: float) -> float:
    """Deviations; 0 where the law leaves no structure there."""
    one = twin.hypothesis.fit.point
    try:
        there = twin.hypothesis.fit.setting.evaluate(twin.at(size))
        points = Points(r.question.base, (one, there))
        alone = replace(r, question=replace(r.question, members=(twin.hypothesis,), rivals=()))
        more = _again(alone, points)
    except CvxupdateError:
        return 0.0
    n = len(r.scale.priors)
    some = [*range(n), n + k, n + k]  # at the level that was recorded they are one and the same
    known = Products(r.known.gram[np.ix_(some, some)], r.known.rows, r.known.channels)
    scale = replace(r.scale, likely=np.full(2, 0.5), unknowns=np.ones(2))
    return scale.separations(known + more, 2)[0]


def _again(r: Responses, points: Points) -> Products:
    """The responses that were measured, once more."""
    place = points.base.setting.model.place
    parts: list[Products] = []
    for s in r.evidence.data.sharp:
        sensors = [x for x in s.sensors if x in place]
        for drive in s.inputs:
            if sensors and drive in place:
                parts += r.products(points, sensors, drive)
    if not parts:
        raise ModelError("no response was measured at a place of the model.")
    return total(parts[1:], parts[0])


def checks_of_tables(
    hypotheses: Sequence[Hypothesis], told: Callable[[Hypothesis, Real], float]
) -> list[LawCheck]:
    """The same frequencies at other levels; ``told`` gives the deviations between a hypothesis and
    itself with other unknowns."""
    return [
        t.check([told(t.hypothesis, t.at(s)) for s in t.sizes])
        for t in twins(hypotheses)
        if t.law.figure == "k"  # losses move no frequency
    ]


def linear_says(evidence: Evidence, count: int) -> str:
    """What a level tells of linear explanations, in words."""
    change = evidence.level_change()
    if change is not None and change.exceeds(LEVEL_CHANGE):
        return (
            f"The {change.what} change with the level by {100.0 * change.change:.2g} %, and none "
            f"of the {count} explanations does, for all are linear: record time histories from "
            "rest at two levels or more, by which laws that depend on the level are told."
        )
    return (
        f"No level of excitation tells the {count} explanations apart: all are linear, and their "
        "responses to a unit of force are the same at every level."
    )
