"""What brings a model to recordings of which nothing is to be claimed: a reference state."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import alike_everywhere, on_a_rig, sharpened
from cvxupdate.diagnose.search.driven import settled, shaken
from cvxupdate.diagnose.search.grown import carried
from cvxupdate.diagnose.search.guided import brought_near
from cvxupdate.diagnose.search.race import merged, tenable
from cvxupdate.diagnose.search.search import Found, names_tried
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS, SEVERAL_LEVEL
from cvxupdate.diagnose.types import Evidence, Progress, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.physics.effect import MODES


@dataclass(frozen=True)
class Near:
    """What was ``found``, and whether it is ``enough``: then nothing else is to be sought."""

    found: Found
    enough: bool


def nearest(evidence: Evidence, progress: Progress) -> Near:
    """What brings a model that is far off to recordings of which nothing is to be claimed: the
    first sets that explain them, or all modes in them, are enough, whatever else would."""
    near, enough = _brought_near(evidence, progress) if names_tried(evidence) else ([], False)
    several = [h for h in near if len(h.effects) > 1]
    if enough:
        several = merged(several, shaken(evidence, several, progress))
    singles = [h for h in near if len(h.effects) == 1]
    found = Found((), tuple(settled(evidence, singles)), tuple(settled(evidence, several)))
    return Near(found, enough)


def with_near(found: Found, near: Found) -> Found:
    """What a search found and what had brought the model nearer before."""
    singles = merged(found.singles, near.singles)
    return replace(
        found, singles=tuple(singles), several=tuple(merged(found.several, near.several))
    )


def _brought_near(evidence: Evidence, progress: Progress) -> tuple[list[Hypothesis], bool]:
    """Tables of modes by what a rig does everywhere; a model that is far off from responses by that
    of the modes in them, and by its approach where that does not explain these. Best first, and
    whether that is enough."""
    if evidence.told_by == MODES:
        found = alike_everywhere(evidence, progress)
        return found, bool(found) and evidence.clear(found[0].fit)
    if evidence.bases[-1].misfit <= HOPELESS * EXPLAINED:
        return [], False
    told, sure = by_modes(evidence, progress)
    if sure:
        return told, True
    found = merged(brought_near(evidence, progress), told)
    return found, bool(found) and found[0].fit.misfit <= EXPLAINED


def by_modes(evidence: Evidence, progress: Progress) -> tuple[list[Hypothesis], bool]:
    """What a rig does everywhere by the modes in responses, on these responses with the rest of a
    rig beside (sensors, the force channel, the shaker), which modes tell little of; and freed of
    what is likelier without. Best first, nothing without modes; and whether it explains them."""
    modes, approach = evidence.by_modes(), evidence.approach
    if modes is None or approach is None:
        return [], False
    progress("seeking what a rig does by the modes in the responses")
    told = on_a_rig(modes, progress)
    here = carried(evidence, told[0]) if told else None
    if here is None:
        return [], False
    whole = approach.rigged(here) or here
    try:
        for level in range(SEVERAL_LEVEL, evidence.levels):
            setting = evidence.at_level(whole.fit.setting, level)
            fit, _ = approach.taken(Seed(whole.effects, setting, whole.fit.p), "sharp")
            whole = Hypothesis(whole.effects, fit)
    except CvxupdateError:
        return [], False
    found = sharpened(evidence, whole, progress) if tenable(evidence, whole) else []
    ranked = sorted(merged(found), key=merit, reverse=True)
    return ranked, bool(ranked) and modes.clear(told[0].fit)
