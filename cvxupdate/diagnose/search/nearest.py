"""What brings a model to recordings of which nothing is to be claimed: a reference state."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.classes import alike_everywhere
from cvxupdate.diagnose.search.driven import settled, shaken
from cvxupdate.diagnose.search.guided import brought_near
from cvxupdate.diagnose.search.met import met
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.search.search import Found, by_count, names_tried
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS
from cvxupdate.diagnose.types import Evidence, Progress
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
    told = settled(evidence, [*(h for h in near if len(h.effects) == 1), *several], progress)
    return Near(Found((), *by_count(told)), enough)


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
    told = met(evidence, progress)
    found = told.sets
    if found and (told.sure or _explains(found[0])):
        return found, True
    found = merged(brought_near(evidence, progress), found)
    return found, bool(found) and _explains(found[0])


def _explains(h: Hypothesis) -> bool:
    return h.fit.misfit <= EXPLAINED
