"""Effects at finite sizes, by a measure of what they leave; and the first steps of a model that is
far off."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import (
    FIXTURE,
    SPRINGS,
    Hypothesis,
    at_nominal,
    further,
    seeds_from,
    together,
    without,
)
from cvxupdate.diagnose.nominal.wanted import by_theory
from cvxupdate.diagnose.responses.bounded import Gap, Yielding, approached
from cvxupdate.diagnose.responses.few import Measure
from cvxupdate.diagnose.responses.finite_size import few_directions, on_few_lines, whole_member
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.sets import sets_of_elements
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.screen.shortlist import best_of, members, not_among
from cvxupdate.diagnose.settings import SEVERAL_LEVEL, STARTS, WHOLE, WHOLES
from cvxupdate.diagnose.types import Evidence, FiniteSize, Key, Score, Seed
from cvxupdate.forked import every
from cvxupdate.physics import effect_types
from cvxupdate.physics.effect import RESPONSES, Effect, EffectType
from cvxupdate.physics.shaker import at_drive, goes, marked, parts_of, with_drive


def at_finite_sizes(
    evidence: Evidence,
    parent: Hypothesis,
    effects: Sequence[Effect],
    left: Measure,
    sift: Projection | None = None,
) -> FiniteSize:
    """Effects beside those of a parent, which stays as it is: in closed form where one acts along
    few directions, in the basis of the lowest modes for sets of elements, and by a model for each
    size for whole members; what derivatives say of them is taken on few lines. ``left`` measures
    what each leaves; ``sift`` as in `few_directions`."""
    point, thin = parent.fit.point, on_few_lines(parent.fit.point)
    linear = first_order(thin, effects, sift or Projection.of(linearised(point)))
    ways: tuple[Callable[[], list[Score]], ...] = (
        lambda: few_directions(point, linear, left, sift, thin),
        lambda: sets_of_elements(point, linear, left),
    )
    exact = best_of(*every(lambda way: way(), ways, evidence.jobs))
    whole = not_among(members(linear), exact)[:WHOLES]
    seeds = seeds_from(evidence, parent, whole, parent.fit.setting.level)
    ranked = sorted((whole_member(point, s, left) for s in seeds), key=lambda pair: -pair[1])
    return FiniteSize(exact, [seed for seed, _ in ranked[:WHOLE]])


@dataclass(frozen=True)
class Guide:
    """How a model that is far off is brought near: by a comparison that no line can dominate
    (`cvxupdate.diagnose.responses.bounded`). ``known``: what is asked for more than once."""

    evidence: Evidence
    known: dict[object, Any] = field(default_factory=dict)

    def begun(self) -> Hypothesis:
        """What sets grow on: the model with nominal nuisance parameters; where theory wants shear
        of its beams, with that. Beside what a rig does it alone brings nothing nearer, and where
        it is wanting other effects imitate it."""
        bare = at_nominal(self.evidence, Hypothesis((), self.evidence.bases[0]), SEVERAL_LEVEL)
        return by_theory(self.evidence, bare) or bare

    def rigged(self, parent: Hypothesis, held: bool = False) -> Hypothesis | None:
        """A parent with all that a rig does, as yet of no size: what hardly a test is without, in
        some measure. The fit tells in what. Supports that stand on a fixture give way with it;
        ``held``: those that it lets give way do so as it says."""
        rig = _classes(self._rig(parent), parent.effects)
        mounts = (FIXTURE, SPRINGS) if held else (FIXTURE,)
        fixed = any(e.physics in mounts and not at_drive(e) for e in parent.effects)
        found = together(self.evidence, parent, _widest(rig) if fixed else rig)
        return None if found is parent else found

    def shaker(self, parent: Hypothesis) -> Effect | None:
        """What a shaker may bring where it drives a parent; None where nothing does, or the parent
        has that."""
        return next((e for e in self._rig(parent) if parts_of(e)), None)

    def alike(self, parent: Hypothesis) -> Hypothesis | None:
        """A parent with a rig of which one number says all joints, and one how all feet turn, as
        yet of no size, and without a shaker: the fewest things that a rig may be. None where
        `rigged` is that already."""
        rig = _classes(self._rig(parent), parent.effects)
        fewest = _covering([e for e in rig if not parts_of(e)])
        return together(self.evidence, parent, fewest) if len(fewest) < len(rig) else None

    def mounted(self, parent: Hypothesis, count: int) -> list[Seed]:
        """A parent on the ``count`` fixtures or cords that bring it nearest, with all else that a
        rig does: beside springs that give way as they should the mass of what holds them does not
        show."""
        rig = _widest([e for e in _classes(self._rig(parent), parent.effects) if not parts_of(e)])
        mounts = tuple({t.name for t in effect_types() if t.mount})
        key = "mounted", parent.keys, parent.fit.setting.level, parent.fit.p.tobytes()
        if key not in self.known:
            whole = together(self.evidence, parent, rig)
            self.known[key] = whole, self._sized(whole, mounts, mount=True)
        whole, sized = self.known[key]
        return self._seeds(whole, sized, count)

    def _rig(self, parent: Hypothesis) -> list[Effect]:
        context = self.evidence.context(parent.fit.setting.model)
        found = [e for t in self._types() for e in t.candidates(context)]
        own, seen, out = context.own or frozenset(), {k[:2] for k in parent.keys}, list[Effect]()
        for e in found:
            again = e.change is not None and e.key[:2] in seen  # the same another way
            if e.key not in parent.keys and not again and own.issuperset(e.place.elements):
                seen.add(e.key[:2])
                out.append(e)
        return out

    def _types(self) -> list[EffectType]:
        known = (t for t in effect_types() if t.rig and t.name in self.evidence.names)
        return [t for t in known if RESPONSES in t.told_by]

    def beside(self, parent: Hypothesis, count: int) -> list[Seed]:
        """The ``count`` effects that bring a parent, as it is, nearest, each at its best size."""
        return self._seeds(parent, self._sized(parent, self.evidence.names), count)

    def _sized(self, parent: Hypothesis, names: Sequence[str], mount: bool = False) -> FiniteSize:
        wanted = [n for n in self.evidence.names if n in names]
        found = self.evidence.candidates(parent.fit.setting.model, wanted)
        effects = [c for c in further(found, parent) if c.type.mount >= mount]
        return at_finite_sizes(self.evidence, parent, effects, Yielding.of(parent.fit.point))

    def _seeds(self, parent: Hypothesis, sized: FiniteSize, count: int) -> list[Seed]:
        nearest = _several(sorted(sized.scores, key=lambda s: -s.fraction), count)
        nearest += [other for s in nearest for other in _otherwise(s)]
        seeds = seeds_from(self.evidence, parent, nearest, parent.fit.setting.level)
        return [self._damped(parent, s) for s in (*seeds, *sized.seeds)]

    def another_way(self, h: Hypothesis) -> list[Seed]:
        """The same with one of its changes another way at its place, of the same size."""
        at, out = len(h.fit.setting.model.parameters) - sum(e.columns for e in h.effects), []
        for k, e in enumerate(h.effects):
            p, at = h.fit.p[at : at + e.columns], at + e.columns
            found = (
                ()
                if e.change is None
                else e.type.candidates(self.evidence.context(self.evidence.model))
            )
            keys = [c.key for c in found if c.key[:2] == e.key[:2] and c.key != e.key]
            rest = without(self.evidence, h, k) if keys else None
            if rest is not None:
                there = e.type.candidates(self.evidence.context(rest.fit.setting.model))
                scores = [Score(c, 0.0, p, exact=True) for c in there if c.key in keys]
                out += seeds_from(self.evidence, rest, scores, h.fit.setting.level)
        return [self._damped(h, seed) for seed in out]

    @staticmethod
    def _damped(parent: Hypothesis, seed: Seed) -> Seed:
        """With the damping of the parent, which is beside its parameters in both."""
        old, new = parent.fit.setting, seed.setting
        a, b = len(old.model.parameters), len(new.model.parameters)
        count = min(old.ratios.stop - a, new.ratios.stop - b)
        start = seed.start.copy()
        start[b : b + count] = parent.fit.p[a : a + count]
        return Seed(seed.effects, new, start, seed.continued)

    def taken(self, seed: Seed, effort: str) -> tuple[Fit, float]:
        """Fitted by that comparison from a seed, and what it leaves (0: nothing; 1: as much as two
        responses that have nothing to do with one another)."""
        known: tuple[Fit, float] | None = self.known.get(_asked(seed, effort))
        return approached(seed.setting, seed.start, EFFORTS[effort]) if known is None else known

    def remember(self, seed: Seed, effort: str, found: tuple[Fit, float]) -> None:
        """What is `taken` from there, without fitting it again."""
        self.known[_asked(seed, effort)] = found

    def left(self, h: Hypothesis) -> float:
        """What it leaves of a hypothesis as it is."""
        return Gap.of(h.fit.point).mean

    def _moves(self, h: Hypothesis) -> bool:
        """Whether the drive is at one place in what is fitted, and elsewhere in what is not."""
        context = self.evidence.context(h.fit.setting.model)
        return len(context.forces) == 1 and bool(context.later)

    def shaken(self, h: Hypothesis) -> Seed | None:
        """With a shaker of no size where it drives."""
        if (
            any(map(at_drive, h.effects))
            or not self._moves(h)
            or FIXTURE not in self.evidence.names
        ):
            return None
        nothing = [Score(e, 0.0, np.zeros(e.count)) for e in self._rig(h) if parts_of(e)]
        seed = next(iter(seeds_from(self.evidence, h, nothing, h.fit.setting.level)), None)
        return None if seed is None else self._damped(h, seed)

    def with_drive(self, h: Hypothesis) -> Hypothesis | None:
        """The same where the shaker takes along what stands where it drives; None where nothing
        does, or no other place is driven in what was held out."""
        if not any(map(at_drive, h.effects)) or not self._moves(h):
            return None
        effects, model, going = [], h.fit.setting.model, list[int]()
        at = len(model.parameters) - sum(e.columns for e in h.effects)
        for e in h.effects:
            effects.append(with_drive(e) if at_drive(e) else e)
            if goes(effects[-1]):
                going += range(at, at + e.columns)
            at += e.columns
        if not going:
            return None
        setting = replace(h.fit.setting, model=marked(model, going))
        point = replace(h.fit.point, setting=setting)
        return Hypothesis(tuple(effects), replace(h.fit, setting=setting, point=point))


def _asked(seed: Seed, effort: str) -> object:
    return effort, seed.keys, seed.setting.level, seed.start.tobytes()


def _classes(effects: Sequence[Effect], known: Sequence[Effect]) -> list[Effect]:
    """Without those at one place of a class that is there as a whole, or ``known``: beside it each
    says once more what the class says."""
    several = [e for e in (*effects, *known) if len(e.place.nodes) > 1 and e.change is not None]
    return [e for e in effects if not any(_within(e, c) for c in several)]


def _within(effect: Effect, several: Effect) -> bool:
    same = effect.physics == several.physics and effect.place.dof == several.place.dof
    return same and set(effect.place.nodes) < set(several.place.nodes)


def _widest(effects: Sequence[Effect]) -> list[Effect]:
    """Without supports, and without joints that are a part of a larger class."""

    def within(e: Effect, other: Effect) -> bool:
        return set(e.place.elements) < set(other.place.elements)

    free = [e for e in effects if e.fault or e.place.elements or not e.place.nodes or at_drive(e)]
    return [e for e in free if not (e.place.elements and any(within(e, o) for o in free))]


def _covering(effects: Sequence[Effect]) -> list[Effect]:
    """Without joints that are a part of a larger class, and the supports about one axis where there
    is a class of those about all."""

    def covered(e: Effect, other: Effect) -> bool:
        about_all = e.place.turns and other.place.dof is None
        feet = about_all and set(e.place.nodes) <= set(other.place.nodes)
        part = set(e.place.elements) < set(other.place.elements)
        return e.physics == other.physics and (part if e.place.elements else feet)

    return [e for e in effects if not any(covered(e, o) for o in effects)]


def _otherwise(score: Score) -> list[Score]:
    """The same effect from other starts."""
    change = score.effect.change
    if change is None or change.others is None:
        return []
    return [replace(score, p=p) for p in change.others(score.p)]


def _several(scores: Sequence[Score], count: int) -> list[Score]:
    """Of the first ``count`` effects the first sizes; of one effect on places that share a node or
    an element only the first place, for the others do nearly the same."""
    found: dict[Key, list[Score]] = {}
    for s in scores:
        own = found.get(s.effect.key)
        if own is not None:
            own.append(s)
        elif len(found) < count and not any(_shares(s.effect, o[0].effect) for o in found.values()):
            found[s.effect.key] = [s]
    return [s for own in found.values() for s in own[:STARTS]]


def _shares(one: Effect, other: Effect) -> bool:
    if one.physics != other.physics or one.place.dof != other.place.dof:
        return False
    if bool(one.place.groups) != bool(other.place.groups):
        return False  # a whole member does what no part of it does
    if one.place.elements or other.place.elements:
        return bool(set(one.place.elements) & set(other.place.elements))
    return bool(set(one.place.nodes) & set(other.place.nodes))
