"""The best single effect at the other places that may be as likely, refitted where it ended.

On smooth recordings, beside nuisance parameters that the mismatch bends, many places of one effect
do alike, and few of them are refitted: one that is not is no rival, however likely it may be. Among
several effects an exchange finds them (`cvxupdate.diagnose.search.exchange`); a single one has its
own places compared here, beside the nuisance parameters that its fit ended with.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from, without
from cvxupdate.diagnose.screen.shortlist import best_of, shortlist
from cvxupdate.diagnose.search.exchange import likeliest, tuned_as, walked
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.settings import NEIGHBOURING, NEIGHBOURS, TRIAGED
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.physics.effect import MODES, MOTION

PLACES = "other places of the best effect"


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
        seeds = _seeds(evidence, best, {h.keys for h in known})
        if seeds and evidence.hurried:
            evidence.leave(PLACES, len(seeds))
            return None
        near = entered(evidence, seeds, progress)
        near = [h for h in near if h.penalised <= TRIAGED * best.penalised]
        return raced(evidence, near, ((last, len(seeds)),), progress)

    return walked(found, best, elsewhere)


def _seeds(evidence: Evidence, best: Hypothesis, tried: Collection[frozenset[Key]]) -> list[Seed]:
    """The effect at other places, those first that do most in its place."""
    rest = without(evidence, best, 0)
    if rest is None:
        return []
    own = best.effects[0]
    there = tuned_as(best, 0, evidence.candidates(rest.fit.setting.model, (own.physics,)))
    sized = evidence.finite_size(rest.fit, rest.fit, (), there)
    scores = best_of(sized.scores) or best_of(evidence.first_order(rest.fit, there))
    mine = next((s.fraction for s in scores if s.effect.key == own.key), None)
    if mine is None:
        return []
    near = [s for s in scores if s.fraction >= NEIGHBOURING * mine and s.effect.key != own.key]
    fresh = [s for s in near if frozenset({s.effect.key}) not in tried]
    level = evidence.levels - 1
    return seeds_from(evidence, rest, shortlist(fresh, NEIGHBOURS, NEIGHBOURS), level)
