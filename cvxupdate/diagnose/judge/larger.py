"""Whether a larger set of effects is needed where a smaller one was accepted."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.judge.acceptance import (
    Case,
    Weighed,
    credible,
    meshed,
    needs_several,
    refuted,
    saturated,
)
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.nominal.wanted import by_tables_alone, sought
from cvxupdate.diagnose.settings import STRONG
from cvxupdate.physics.effect import RESPONSES


def needed(more: Weighed, final: Weighed | None, case: Case) -> bool:
    """Whether ``more`` effects are needed beyond what was accepted (``final``): that leaves
    something open, and they halve it for each (`needs_several`); or responses are strong evidence
    for them, though what is left may be a sound model's."""
    if _open(final, more, case) and needs_several(more, final, case):
        return True
    if final is None or case.damping_only or case.evidence.told_by != RESPONSES:
        return False
    if case.evidence.clear(final.fit):
        return False
    sound = credible(more, case) and not (saturated(more, case) or refuted(more, case))
    return sound and not meshed(final, case) and _strongly_likelier(more, final, case)


def _open(final: Weighed | None, more: Weighed, case: Case) -> bool:
    """Whether what is accepted leaves something to a larger set: more than noise and tolerance; or
    tables of modes without a reference are strong evidence for the larger one: in the tolerance of
    any model one that was fitted hides what is still missing, as the rest of a rig."""
    if final is None or not case.evidence.clear(final.fit):
        return True
    return by_tables_alone(case.evidence) and _strongly_likelier(more, final, case)


def _strongly_likelier(more: Weighed, final: Weighed, case: Case) -> bool:
    """Whether there is strong evidence for a larger set: where more is sought in it than one thing,
    or than before, each pays for its places, and the smaller one must leave more than noise."""
    many, before = (sought(case.evidence, w.hypothesis) for w in (more, final))
    further = max(0, many - max(1, before))
    least = STRONG / 2.0 + further * float(np.log(case.places))
    return log_odds(more, case) > log_odds(final, case) + least and not (
        further and final.fit.spent
    )
