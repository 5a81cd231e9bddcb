"""The best single effect at the other places that may be as likely, refitted where it ended.

On smooth recordings, beside nuisance parameters that the mismatch bends, many places of one effect
do alike, and few of them are refitted: one that is not is no rival, however likely it may be. Among
several effects an exchange finds them (`cvxupdate.diagnose.search.exchange`); a single one has its
own places compared here, beside the nuisance parameters that its fit ended with.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, further, of_a_rig, seeds_from, without
from cvxupdate.diagnose.screen.shortlist import best_of, shortlist
from cvxupdate.diagnose.search.exchange import likeliest, tuned_as, walked
from cvxupdate.diagnose.search.race import entered, raced, refitted
from cvxupdate.diagnose.settings import NEIGHBOURING, NEIGHBOURS, TRIAGED
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.physics.effect import MODES, MOTION

PLACES = "other places of the best effect"
FEW_PLACES = 3


def neighbours(
    evidence: Evidence,
    singles: Sequence[Hypothesis],
    several: Sequence[Hypothesis],
    progress: Progress,
) -> list[Hypothesis]:
    """Single effects (sharpened), and the likeliest of them at the places that do nearly as much
    beside its nuisance parameters; again from there where one of these is likelier. All, best
    first. As they are where one of ``several`` is likelier. Laws that follow the motion have
    `cvxupdate.diagnose.search.alike`; a few frequencies never tell a node from the next of a fine
    mesh, however well they tell where."""
    found, last = list(singles), evidence.levels - 1
    best = likeliest([*several, *singles])
    if best is None or len(best.effects) > 1 or evidence.told_by in (MODES, MOTION):
        return found

    def elsewhere(best: Hypothesis, known: Sequence[Hypothesis]) -> list[Hypothesis] | None:
        seeds = _seeds(evidence, best, 0, {h.keys for h in known})
        if seeds and evidence.hurried:
            evidence.leave(PLACES, len(seeds))
            return None
        near = entered(evidence, seeds, progress)
        near = [h for h in near if h.penalised <= TRIAGED * best.penalised]
        return raced(evidence, near, ((last, len(seeds)),), progress)

    return walked(found, best, elsewhere)


def at_last(
    evidence: Evidence, several: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Where time ended the search for ``several`` effects (sharpened): the likeliest set with each
    thing sought in it at the `FEW_PLACES` that do most in its place, refitted from where the rest
    is. So little is done although time is over: a place that was compared with none is a guess."""
    best = likeliest([h for h in several if len(h.effects) > 1])
    if best is None or not evidence.hurried or evidence.told_by == MOTION:
        return []
    out: list[Hypothesis] = []
    for number, effect in enumerate(best.effects):
        if of_a_rig(effect) or effect.change is None:
            continue
        known = {h.keys for h in (*several, *out)}
        seeds = _seeds(evidence, best, number, known)[:FEW_PLACES]
        for seed in seeds:
            progress(f"comparing with {seed.effects[-1].name}")
            found = refitted(evidence, seed, "sharp")
            out += [] if found is None else [found]
    return out


def _seeds(
    evidence: Evidence, best: Hypothesis, number: int, tried: Collection[frozenset[Key]]
) -> list[Seed]:
    """One of the effects at other places beside the rest, those first that do most in its place."""
    rest = without(evidence, best, number)
    if rest is None:
        return []
    own = best.effects[number]
    there = tuned_as(best, number, evidence.candidates(rest.fit.setting.model, (own.physics,)))
    there = further(there, rest)
    sized = evidence.finite_size(rest.fit, rest.fit, rest.effects, there)
    scores = best_of(sized.scores) or best_of(evidence.first_order(rest.fit, there))
    mine = next((s.fraction for s in scores if s.effect.key == own.key), None)
    if mine is None:
        return []
    near = [s for s in scores if s.fraction >= NEIGHBOURING * mine and s.effect.key != own.key]
    fresh = [s for s in near if rest.keys | {s.effect.key} not in tried]
    level = evidence.levels - 1
    return seeds_from(evidence, rest, shortlist(fresh, NEIGHBOURS, NEIGHBOURS), level)
