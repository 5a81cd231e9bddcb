"""Sets of effects grown from a model that is far off.

Where several things are missing at once no single effect explains much, and what scores best by
weighted squares is what flattens the few worst lines. A comparison that no line can dominate
(`Evidence.approach`) says which effects bring the whole nearer: sets are grown by it, several
abreast (a beam search), then each member of the best is exchanged in turn; weighted squares take
over from where that ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.approach import Approach
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, without
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.race import entered, merged, raced, tenable
from cvxupdate.diagnose.search.several import Pool
from cvxupdate.diagnose.settings import (
    BEAM,
    BUDGET,
    EXPLAINED,
    FINE_SEVERAL,
    GUIDED,
    MOST_EFFECTS,
    NEARER,
    NEAREST,
    OPEN,
    SEVERAL_LEVEL,
    SPARE,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.errors import CvxupdateError

GROWN, RIVALS = "sets of effects that bring the whole nearer", "rivals of members of the best set"


@dataclass(frozen=True)
class Reached:
    """A hypothesis and what the bounded comparison leaves of it."""

    hypothesis: Hypothesis
    left: float


def guided(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """The best sets of two effects and more that grow step by step, sharpened, best first; none of
    evidence without an approach. It takes a part of the time at most: what is sought by weighted
    squares has its turn, too."""
    approach = evidence.approach
    if approach is None:
        return []
    own = Budget(GUIDED * BUDGET, np.inf)
    nothing = at_nominal(evidence, Hypothesis((), evidence.bases[0]), SEVERAL_LEVEL)
    front, found = [Reached(nothing, np.inf)], []
    while _goes_on(evidence, front[0].hypothesis):
        if evidence.hurried or own.over():
            evidence.leave(GROWN)
            break
        best = front[0]
        progress(f"seeking what brings {best.hypothesis.name} nearer")
        seeds = _beside(approach, [r.hypothesis for r in front], NEAREST)
        grown = _taken(evidence, approach, seeds, "first pass")
        if not grown or grown[0].left > NEARER * best.left:
            break
        front = _nearest([*_settled(evidence, approach, grown[:BEAM]), *grown])[:BEAM]
        if _explains(evidence, _carried(evidence, front[:1], progress)):
            return _finished(evidence, front[:1], progress)
        front = _exchanged(evidence, approach, front)
        found = front + found
    return _finished(evidence, _nearest(found)[:BEAM], progress)


def _explains(evidence: Evidence, carried: Sequence[Hypothesis]) -> bool:
    """Whether the best leaves no more than the discrepancy of a sound model; what it leaves beyond
    noise is sought by weighted squares."""
    return bool(carried) and carried[0].fit.misfit <= OPEN * EXPLAINED


def _goes_on(evidence: Evidence, h: Hypothesis) -> bool:
    spare = h.fit.rows - len(evidence.model.parameters) - h.unknowns
    return len(h.effects) < MOST_EFFECTS and spare >= SPARE


def _beside(approach: Approach, parents: Sequence[Hypothesis], count: int) -> list[Seed]:
    """What brings each parent nearest, each set once."""
    out: dict[frozenset[Key], Seed] = {}
    for parent in parents:
        for seed in approach.beside(parent, count):
            out.setdefault(seed.keys, seed)
    return list(out.values())


def _taken(
    evidence: Evidence, approach: Approach, seeds: Sequence[Seed], effort: str
) -> list[Reached]:
    """Seeds brought as near as they come, nearest first; without those that are no structure."""
    found = []
    for seed in seeds:
        if found and evidence.hurried:
            break
        try:
            fit, left = approach.taken(seed, effort)
        except CvxupdateError:
            continue
        h = Hypothesis(seed.effects, fit)
        found += [Reached(h, left)] if tenable(evidence, h) else []
    return _nearest(found)


def _settled(evidence: Evidence, approach: Approach, front: Sequence[Reached]) -> list[Reached]:
    """The same to the end of the way."""
    return _taken(evidence, approach, [_onward(r.hypothesis) for r in front], "sharp")


def _onward(h: Hypothesis) -> Seed:
    return Seed(h.effects, h.fit.setting, h.fit.p)


def _nearest(found: Sequence[Reached]) -> list[Reached]:
    """Nearest first, each set once."""
    best: dict[frozenset[Key], Reached] = {}
    for r in sorted(found, key=lambda r: r.left):
        best.setdefault(r.hypothesis.keys, r)
    return list(best.values())


def _exchanged(evidence: Evidence, approach: Approach, front: Sequence[Reached]) -> list[Reached]:
    """The nearest sets, and those in which one member of the nearest of all is another; all but its
    last, which was just chosen."""
    found = list(front)
    best = front[0].hypothesis
    for index in range(len(best.effects) - 1):
        if evidence.hurried:
            break
        rest = without(evidence, best, index)
        if rest is None:
            continue
        seeds = [s for s in approach.beside(rest, NEAREST) if s.keys != best.keys]
        again = _taken(evidence, approach, seeds, "first pass")
        found += [*_settled(evidence, approach, again[:1]), *again]
    return _nearest(found)[:BEAM]


def _carried(evidence: Evidence, sets: Sequence[Reached], progress: Progress) -> list[Hypothesis]:
    """By weighted squares from where they stand, best first."""
    found = entered(evidence, [_onward(r.hypothesis) for r in sets], progress)
    return raced(evidence, found, ((SEVERAL_LEVEL, len(found)),), progress)


def _finished(evidence: Evidence, sets: Sequence[Reached], progress: Progress) -> list[Hypothesis]:
    """Sets by weighted squares; the best of them also without each of its effects (backward), and
    where it explains with others
    in the place of each, against which it must stand; the best of all sharpened."""
    known = _carried(evidence, sets, progress)
    if not known:
        return []
    best = known[0]
    rests = [without(evidence, best, k) for k in range(len(best.effects))]
    kept = [r for r in rests if r is not None]
    found = entered(evidence, [_onward(r) for r in kept if r.effects], progress)
    fewer = raced(evidence, found, ((SEVERAL_LEVEL, len(found)),), progress)
    pool = Pool(evidence, progress, {h.keys: h for h in known})
    pool.tried.update(pool.found, (h.keys for h in fewer))
    for rest in kept if _explains(evidence, known) else ():
        if evidence.hurried:
            evidence.leave(RIVALS)
            break
        progress(f"seeking beside {rest.name} again")
        pool.refit(beside(evidence, rest))
    # by themselves, so that one with an effect too many does not leave them behind
    simple = raced(evidence, [h for h in fewer if len(h.effects) > 1], FINE_SEVERAL, progress)
    sets = [h for h in pool.found.values() if len(h.effects) > 1]
    return merged(raced(evidence, sets, FINE_SEVERAL, progress), simple)
