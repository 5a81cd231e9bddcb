"""A rig met first by the modes in responses.

A model that lacks all of a rig is so far off from responses that no single effect brings it nearer,
and sets that grow from there take minutes. Its modes are a few figures, which all that a rig does
everywhere is fitted to in a second, with what else shows beside; from there a fit of the responses
is in their valley, and what modes are too few to tell shows in these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig
from cvxupdate.diagnose.modes.identified import FEW
from cvxupdate.diagnose.nominal.wanted import by_theory
from cvxupdate.diagnose.search.backward import backward, merit
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.classes import on_a_rig, sharpened
from cvxupdate.diagnose.search.coarse import follows
from cvxupdate.diagnose.search.completed import (
    beside_fixtures,
    completed,
    in_its_place,
    with_one_more,
)
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.search.unlike import with_one_unlike
from cvxupdate.diagnose.search.untuned import tenable
from cvxupdate.diagnose.search.valleys import in_other_valleys
from cvxupdate.diagnose.settings import EXPLAINED, OPEN, SEVERAL_LEVEL, STAYING
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.errors import CvxupdateError

OTHERS = "what else is likely by the modes in the responses"


@dataclass(frozen=True)
class Met:
    """``sets`` on these responses, best first; whether the likeliest by the modes explains them
    (``sure``)."""

    sets: list[Hypothesis]
    sure: bool


def met(evidence: Evidence, progress: Progress) -> Met:
    """What a rig does everywhere by the modes in responses, with one effect beside, on these
    responses with the rest of a rig (sensors, the force channel, the shaker), which modes tell
    little of, and freed of what is likelier without. Where that explains the modes, of each effect
    beside a rig, and of none, the likeliest, until one explains the responses, and the best of
    them, if these follow it, with one effect more. What explains is freed of each effect that it
    does not need. Nothing without modes."""
    modes = evidence.by_modes(FEW)
    told = [] if modes is None else _each(_told(modes, progress))
    sure = bool(told) and modes is not None and modes.clear(told[0].fit)
    found: list[Hypothesis] = []
    for h in told[: STAYING if sure else 1]:
        if evidence.hurried:
            evidence.leave(OTHERS)
            break
        found = _ranked(found, _here(evidence, h, progress))
        if found and _explains(found[0]):
            break
    found = _freed(evidence, found, progress)
    if not found or not (_explains(found[0]) or (sure and follows(evidence, found[0]))):
        return Met(found, sure)
    more = _ranked(with_one_more(evidence, found[0], progress))
    better = bool(more) and merit(more[0]) > merit(found[0])
    more = _freed(evidence, more, progress) if better else more
    return Met(_ranked(found, more), sure)


def _freed(evidence: Evidence, found: Sequence[Hypothesis], progress: Progress) -> list[Hypothesis]:
    """With the likeliest freed of each effect that it does not need, if it explains."""
    freer = backward(evidence, found[0], progress)[1] if found and _explains(found[0]) else []
    return _ranked(found, freer)


def _told(modes: Evidence, progress: Progress) -> list[Hypothesis]:
    """What a rig does by modes, with one that is not like the others, completed where all of it at
    once does not explain them, with one effect more where that leaves half of what noise makes, and
    others in the place of the likeliest one; likeliest first."""
    progress("seeking what a rig does by the modes in the responses")
    found = on_a_rig(modes, progress)
    found = _ranked(found, with_one_unlike(modes, found, progress))
    if found and not modes.clear(found[0].fit):
        found = _ranked(found, completed(modes, found[:1], progress))
        found = _ranked(found, beside_fixtures(modes, found, progress))
    if not found:
        return []
    found = _ranked(found, in_other_valleys(modes, found, progress))
    found = _ranked(found, with_one_more(modes, found[0], progress))
    return _ranked(found, in_its_place(modes, found[0], progress))


def _each(told: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The first of each effect, or none, that stands beside what a rig does."""
    first: dict[frozenset[Key], Hypothesis] = {}
    for h in told:
        first.setdefault(frozenset(e.key for e in h.effects if not of_a_rig(e)), h)
    return list(first.values())


def _here(evidence: Evidence, told: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """What modes told on these responses with the rest of a rig (how supports give way they say)
    and the shear that theory wants, for which a few modes take soft joints, freed of what is
    likelier without: brought near first by a comparison that no line can dominate; and by weighted
    squares at once where that does not explain, for the comparison leaves open how much a channel
    reads. Likeliest first."""
    approach, here = evidence.approach, carried(evidence, told)
    if approach is None or here is None:
        return []
    progress(f"fitting {told.name} to the responses")
    begun = approach.rigged(here, held=True) or here
    begun = by_theory(evidence, begun) or begun
    found: list[Hypothesis] = []
    for whole in (_near(evidence, begun), begun):
        if whole is not None and tenable(evidence, whole):
            found = _ranked(found, sharpened(evidence, whole, progress))
        if found and _explains(found[0]):
            break
    return found


def _near(evidence: Evidence, whole: Hypothesis) -> Hypothesis | None:
    """Brought as near as it comes, level by level; None where that leads to no structure."""
    approach = evidence.approach
    try:
        for level in range(SEVERAL_LEVEL, evidence.levels):
            setting = evidence.at_level(whole.fit.setting, level)
            fit, _ = approach.taken(Seed(whole.effects, setting, whole.fit.p), "sharp")
            whole = Hypothesis(whole.effects, fit)
    except CvxupdateError:
        return None
    return whole


def _explains(h: Hypothesis) -> bool:
    return h.fit.misfit <= OPEN * EXPLAINED


def _ranked(*sets: Sequence[Hypothesis]) -> list[Hypothesis]:
    return sorted(merged(*sets), key=merit, reverse=True)
