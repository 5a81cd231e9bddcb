"""The best set of effects with each of them exchanged at the fit: for another place, another word.

Sets are found from smooth recordings on, beside fits that the mismatch bends: there many neighbours
do alike, few of them are refitted, and what began where it got stuck is not tried again. At the end
the rest of the best set is as true as it will be, and what does as much beside it as the effect
that was taken out is refitted from there (forward and backward steps in turn; Hastie, Tibshirani
and Friedman 2009, 3.3 and 9.1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig, seeds_from, without
from cvxupdate.diagnose.hypothesis import further as placeable
from cvxupdate.diagnose.screen.shortlist import best_of, shortlist
from cvxupdate.diagnose.search.backward import firm, merit
from cvxupdate.diagnose.search.race import entered, merged, raced, refitted
from cvxupdate.diagnose.search.several import at_level
from cvxupdate.diagnose.settings import (
    EACH,
    FINE_SEVERAL,
    HALVED,
    NEIGHBOURS,
    PARTNERS,
    SEVERAL_LEVEL,
    SHORT,
    WALKS,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Score, Seed
from cvxupdate.forked import Ahead
from cvxupdate.physics.effect import MOTION, Effect, HiddenOscillator
from cvxupdate.physics.place import Place
from cvxupdate.physics.shaker import at_drive

LEGS = ((SEVERAL_LEVEL, PARTNERS), *FINE_SEVERAL)
LEAST_RATIO = 1e-4  # of damping, of an oscillator with a dashpot: without, it has no such unknown
EXCHANGED = "other effects in place of each of the best set"


def crowded(evidence: Evidence, sets: Sequence[Hypothesis]) -> bool:
    """Whether the likeliest set has more than two effects, two of them such as no rig does: two
    that nobody sought may do as much, for what two explain, many imitate. Not where what a rig
    does in it halves by itself, as it is, what nuisance parameters leave: without that no two come
    near."""
    best = likeliest(sets)
    if best is None or len(best.effects) < 3:
        return False
    sought = [k for k, e in enumerate(best.effects) if not (of_a_rig(e) or at_drive(e))]
    if len(sought) < 2:
        return False
    rig = without(evidence, best, *sought) if len(sought) < len(best.effects) else None
    return rig is None or rig.fit.misfit > HALVED * evidence.bases[-1].misfit


def exchanged(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """``known`` (sharpened) and the likeliest set of them with its effects exchanged, what is
    sought before what a rig does and what is least sure before the rest, as long as another is
    likelier then; what a rig does against all that may be, and then against what came nearest. All,
    best first. Laws that follow the motion are not: what is hardly told from
    them is refitted where they are told (`cvxupdate.diagnose.search.alike`), and each fit takes a
    simulation."""
    found = list(known)
    if evidence.told_by == MOTION:
        return found
    best = likeliest([h for h in found if len(h.effects) > 1])
    rivals: dict[Key, list[Score]] = {}

    def beside(best: Hypothesis, _: Sequence[Hypothesis]) -> list[Hypothesis] | None:
        def surely(k: int) -> tuple[bool, bool]:
            return of_a_rig(best.effects[k]), firm(best, k)

        out: list[Hypothesis] = []
        for number in sorted(range(len(best.effects)), key=surely):
            effect = best.effects[number]
            own = rivals.get(effect.key) if of_a_rig(effect) else None
            seeds = _instead(evidence, best, number, progress, own)
            if seeds is None:
                evidence.leave(EXCHANGED)
                return out or None
            reached = raced(evidence, entered(evidence, seeds, progress), LEGS, progress)
            rivals.setdefault(effect.key, [_as_reached(h) for h in reached])
            out += reached
        return out

    return found if best is None else walked(found, best, beside)


def _as_reached(h: Hypothesis) -> Score:
    """The last effect of a fitted set, at its size."""
    effect = h.effects[-1]
    return Score(effect, 1.0, h.sizes(-1) if effect.columns else h.fit.p[-1:], exact=True)


def walked(
    known: Sequence[Hypothesis],
    best: Hypothesis,
    near: Callable[[Hypothesis, Sequence[Hypothesis]], list[Hypothesis] | None],
) -> list[Hypothesis]:
    """``known`` and what is ``near`` the best of them (beside what is known by then; None ends it),
    again from there as long as one of these is likelier and was not begun from yet. All, best
    first."""
    found, begun = list(known), set[frozenset[Key]]()
    for _ in range(WALKS):
        begun.add(best.keys)
        more = near(best, found)
        if more is None:
            break
        found = merged(found, more)
        ahead = likeliest(more)
        if ahead is None or merit(ahead) <= merit(best) or ahead.keys in begun:
            break
        best = ahead
    return found


def likeliest(sets: Sequence[Hypothesis]) -> Hypothesis | None:
    """By the evidence, less what unknowns cost."""
    return max(sets, key=merit, default=None)


def _instead(
    evidence: Evidence,
    best: Hypothesis,
    number: int,
    progress: Progress,
    known: Sequence[Score] | None,
) -> list[Seed] | None:
    """What may stand in place of an effect; of what a rig does, which other effects leave as it is,
    what came nearest before (``known``). None where time is over before."""
    if evidence.hurried:
        return None
    progress(f"seeking in place of {best.effects[number].name}")
    if known is not None:
        return _again(evidence, best, number, known)
    elsewhere = _seeds(evidence, best, number)
    if evidence.hurried:
        return None
    if elsewhere is None:
        return []
    whole = at_level(evidence, best, SEVERAL_LEVEL)
    beside = placeable(evidence.candidates(whole.fit.setting.model), whole)
    return [*elsewhere, *in_other_words(evidence, whole, beside, number, progress)]


def _again(evidence: Evidence, best: Hypothesis, number: int, known: Sequence[Score]) -> list[Seed]:
    """What stood in place of an effect beside others, as large as it was there."""
    rest = without(evidence, best, number)
    if rest is None:
        return []
    smooth = at_level(evidence, rest, SEVERAL_LEVEL)
    found = placeable(evidence.candidates(smooth.fit.setting.model), smooth)
    there = {e.key: e for e in found}
    scores = [replace(s, effect=there[s.effect.key]) for s in known if s.effect.key in there]
    return seeds_from(evidence, smooth, scores, SEVERAL_LEVEL)


def _seeds(evidence: Evidence, best: Hypothesis, number: int) -> list[Seed] | None:
    """What does much beside the rest as it was fitted, to first order or at a finite size: more of
    the type that was taken out, whose places are what is hardest to tell. None where the rest is no
    structure."""
    rest = without(evidence, best, number)
    if rest is None:
        return None
    smooth = at_level(evidence, rest, SEVERAL_LEVEL)
    effects = placeable(evidence.candidates(smooth.fit.setting.model), smooth)
    effects = tuned_as(best, number, effects)
    first = evidence.first_order(smooth.fit, effects)
    sized = evidence.finite_size(smooth.fit, smooth.fit, smooth.effects, effects)
    scores = best_of(first, sized.scores)
    own = best.effects[number].physics
    same = shortlist([s for s in scores if s.effect.physics == own], NEIGHBOURS, NEIGHBOURS)
    other = shortlist([s for s in scores if s.effect.physics != own], SHORT, EACH)
    known = [s for s in (*same, *other) if s.effect.key != best.effects[number].key]
    return [*seeds_from(evidence, smooth, known, SEVERAL_LEVEL), *sized.seeds]


def in_other_words(
    evidence: Evidence,
    whole: Hypothesis,
    effects: Sequence[Effect],
    number: int,
    progress: Progress,
) -> list[Seed]:
    """Of ``effects`` beside the ``whole`` set others at the very place of one of its own, and the
    same on elements of which it has some, from the sizes at which they do as much: both are fitted
    to the end, and the one that was there is taken out. Begun beside the rest alone their sizes
    overshoot, and in the first pass they are left behind."""
    own = whole.effects[number]
    here = [e for e in effects if e.physics != own.physics and _same(e.place, own.place)]
    near = [e for e in effects if e.physics == own.physics and _overlap(e.place, own.place)]
    scores = shortlist(evidence.first_order(whole.fit, here), SHORT, 1)
    scores += shortlist(evidence.first_order(whole.fit, near), EACH, EACH)
    out, seeds = [], seeds_from(evidence, whole, scores, SEVERAL_LEVEL)
    with Ahead(lambda s: refitted(evidence, s, "coarse"), seeds, evidence.jobs) as refits:
        for seed in seeds:
            if evidence.hurried:
                evidence.leave(EXCHANGED)
                break
            progress(f"seeking {seed.effects[-1].name} in place of {own.name}")
            both = refits.take()
            rest = None if both is None else without(evidence, both, number)
            out += [] if rest is None else [rest.onward]
    return out


def _same(a: Place, b: Place) -> bool:
    """Whether two effects act on the same elements, or at the same nodes along the same axis."""
    if a.elements or b.elements:
        return set(a.elements) == set(b.elements) and set(a.nodes) == set(b.nodes)
    return bool(a.nodes) and set(a.nodes) == set(b.nodes) and a.dof == b.dof


def _overlap(a: Place, b: Place) -> bool:
    return not set(a.elements).isdisjoint(b.elements)


def tuned_as(best: Hypothesis, number: int, effects: Sequence[Effect]) -> list[Effect]:
    """Where a hidden oscillator was taken out, those of other places tuned as it is, and no
    others: between two trial frequencies a narrow one shows nothing. With a dashpot if they have
    one: that which was taken out may have been told by modes, and has none."""
    if not isinstance(best.effects[number].action, HiddenOscillator):
        return list(effects)
    out: dict[Key, Effect] = {}
    for e in effects:
        if isinstance(e.action, HiddenOscillator):
            e = replace(e, action=as_fitted(e.action, best.values[number]))
        out.setdefault(e.key, e)
    return list(out.values())


def as_fitted(action: HiddenOscillator, values: Mapping[str, float]) -> HiddenOscillator:
    """One with the frequency and, as far as it has a dashpot, the damping ratio of fitted figures
    (its own where these have none), not planted yet."""
    m = max(values["m"], float(np.finfo(float).tiny))
    omega = float(np.sqrt(max(values["k"], 0.0) / m))
    zeta = action.zeta
    if zeta > 0.0 and "c" in values:
        zeta = max(values["c"] / max(2.0 * m * omega, float(np.finfo(float).tiny)), LEAST_RATIO)
    return replace(action, frequency=omega / (2.0 * np.pi), zeta=zeta, mass=0.0)
