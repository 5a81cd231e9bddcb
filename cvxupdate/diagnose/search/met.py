"""A rig met first by the modes in responses.

A model that lacks all of a rig is so far off from responses that no single effect brings it nearer,
and sets that grow from there take minutes. Its modes are a few figures, which all that a rig does
everywhere is fitted to in a second, with what else shows beside; from there a fit of the responses
is in their valley.
"""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.modes.identified import FEW
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.classes import on_a_rig, sharpened
from cvxupdate.diagnose.search.completed import completed, with_one_more
from cvxupdate.diagnose.search.race import merged, tenable
from cvxupdate.diagnose.settings import SEVERAL_LEVEL
from cvxupdate.diagnose.types import Evidence, Progress, Seed
from cvxupdate.errors import CvxupdateError


def by_modes(evidence: Evidence, progress: Progress) -> tuple[list[Hypothesis], bool]:
    """What a rig does everywhere by the modes in responses, with one effect beside, on these
    responses with the rest of a rig (sensors, the force channel, the shaker), which modes tell
    little of; and freed of what is likelier without. Best first, nothing without modes; and whether
    it explains them."""
    modes, approach = evidence.by_modes(FEW), evidence.approach
    if modes is None or approach is None:
        return [], False
    progress("seeking what a rig does by the modes in the responses")
    told = _told(modes, progress)
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
    ranked = _ranked(found)
    return ranked, bool(ranked) and modes.clear(told[0].fit)


def _told(modes: Evidence, progress: Progress) -> list[Hypothesis]:
    """What a rig does by modes, completed where all of it at once does not explain them, with one
    effect more where that leaves half of what noise makes; likeliest first."""
    found = on_a_rig(modes, progress)
    if found and not modes.clear(found[0].fit):
        found = _ranked(found, completed(modes, found[:1], progress))
    return _ranked(found, with_one_more(modes, found[0], progress)) if found else []


def _ranked(*sets: list[Hypothesis]) -> list[Hypothesis]:
    return sorted(merged(*sets), key=merit, reverse=True)
