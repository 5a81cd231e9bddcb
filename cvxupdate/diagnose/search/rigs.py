"""What a rig alone would explain, beside what was found.

Hardly a test is without what a rig does, and several of its parts together look like something in
the structure that is not there: each alone brings the whole no nearer, so a search that goes step
by step misses them. So they are tried all at once, alone and beside the best set, and freed of
what the evidence is better without; what is claimed must stand against that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, only_a_rig
from cvxupdate.diagnose.search.approach import Approach
from cvxupdate.diagnose.search.backward import backward, merit
from cvxupdate.diagnose.search.classes import at_once, at_once_beside, sharpened
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.search.untuned import tenable
from cvxupdate.diagnose.settings import MOUNTS, PARENTS, SEVERAL_LEVEL
from cvxupdate.diagnose.types import Evidence, Progress, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.forked import Ahead, every
from cvxupdate.physics.effect import MODES, MOTION

RIGS = "what the test rig may do, beside the best set"


def a_rig_alone(
    evidence: Evidence, singles: Sequence[Hypothesis], enough: float, progress: Progress
) -> list[Hypothesis]:
    """All that a rig does, on the mounts that bring the model nearest, sharpened and freed of what
    does little in it, before anything is sought beside the best of ``singles``: where a rig is all,
    everything else would be sought for nothing, and where time ends the search what imitates it
    would stand alone. Nothing where the best leaves no more than ``enough``. Tables of modes have
    no approach, but fits of all that a rig does everywhere, alone and beside the best, where one of
    them leaves nothing; of motions all of it is fitted everywhere, and laws are sought beside."""
    approach = evidence.approach
    if not singles or singles[0].penalised <= enough:
        return []
    if evidence.told_by == MOTION:
        return [h for h in at_once(evidence, progress, False) if len(h.effects) > 1]
    if approach is None:
        found = _everywhere(evidence, singles, progress) if evidence.told_by == MODES else []
        return [h for h in found if len(h.effects) > 1 and evidence.clear(h.fit)]
    progress("seeking what a rig alone would explain")
    whole = _alone(evidence, approach)
    found = [] if whole is None else sharpened(evidence, whole, progress)
    return [h for h in found[-1:] if len(h.effects) > 1]


def _everywhere(
    evidence: Evidence, singles: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """All that a rig does everywhere; where that does not explain, beside each of the best effects
    from where it is alone, for each part of a rig by itself may bring it no nearer."""
    found = at_once(evidence, progress, False)
    if any(evidence.clear(h.fit) for h in found):
        return found
    for h in singles[:PARENTS]:
        if evidence.hurried:
            evidence.leave(RIGS)
            break
        progress(f"fitting all that a rig does everywhere beside {h.name}")
        found += at_once_beside(evidence, h)
    best = max(found, key=merit, default=None)
    if best is not None and evidence.clear(best.fit):
        found += backward(evidence, best, progress)[1]
    return merged(found)


def beside_a_rig(
    evidence: Evidence,
    sets: Sequence[Hypothesis],
    alone: Sequence[Hypothesis],
    progress: Progress,
) -> list[Hypothesis]:
    """The best of the sets with all that a rig does beside it, and all that a rig does where that
    was not tried before (``alone``): both freed of what the evidence is better without (all that
    was tried, sharpened). Nothing where one effect is enough, where the best set (``sets``: best
    first) has nothing but a rig or is a part of what was tried, or without an approach."""
    approach, best = evidence.approach, [h for h in sets if len(h.effects) > 1][:1]
    if approach is None or not best or only_a_rig(best[0]):
        return []
    if any(best[0].keys <= h.keys for h in alone):
        return []
    if evidence.hurried:
        evidence.leave(RIGS)
        return []
    progress("seeking what a rig does beside the best set")
    whole = [None if alone else _alone(evidence, approach), approach.rigged(best[0])]
    out: list[Hypothesis] = []
    for h in whole:
        if h is None or evidence.hurried:
            continue
        tried = sharpened(evidence, h, progress)
        out += [*tried, *backward(evidence, tried[-1] if tried else h, progress)[1]]
    return merged(out)


def _alone(evidence: Evidence, approach: Approach) -> Hypothesis | None:
    """Nothing but what a rig does, brought as near as it comes, level by level."""
    bare = approach.begun()
    ways: tuple[Callable[[], list[Seed]], ...] = (
        lambda: approach.mounted(bare, MOUNTS),
        lambda: [h.onward for h in (approach.rigged(bare), approach.alike(bare)) if h is not None],
    )
    seeds = list(chain.from_iterable(every(lambda way: way(), ways, evidence.jobs)))
    best, least = None, np.inf
    with Ahead(partial(_taken, approach), seeds, evidence.jobs) as fits:
        for seed, found in ((seed, fits.take()) for seed in seeds):
            if found is None:
                continue
            approach.remember(seed, "sharp", (found[0].fit, found[1]))
            if found[1] < least and tenable(evidence, found[0]):
                best, least = found
    if best is None:
        return None
    for level in range(SEVERAL_LEVEL + 1, evidence.levels):
        setting = evidence.at_level(best.fit.setting, level)
        fit, _ = approach.taken(Seed(best.effects, setting, best.fit.p), "sharp")
        best = Hypothesis(best.effects, fit)
    return best


def _taken(approach: Approach, seed: Seed) -> tuple[Hypothesis, float] | None:
    try:
        fit, left = approach.taken(seed, "sharp")
    except CvxupdateError:
        return None
    return Hypothesis(seed.effects, fit), left
