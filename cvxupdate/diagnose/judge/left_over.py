"""What a hypothesis leaves, where, and what that looks like."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.settings import AS_LIKELY, HALVED
from cvxupdate.physics.attached_resonator import AttachedResonator
from cvxupdate.physics.effect import Effect


def left_over(w: Weighed, field: Sequence[Weighed], case: Case) -> str:
    """In one sentence: band and sensors of what is left, and the likeliest effect that halves it
    beside the hypothesis; without its place where others are as likely. Empty where noise is all.
    """
    says = case.evidence.remains(w.fit)
    further = [
        (log_odds(o, case), o, more)
        for o in field
        if (more := _one_more(o.hypothesis, w.hypothesis)) is not None
        and case.scale(o) <= HALVED * case.scale(w)
    ]
    if not says or not further:
        return says
    odds, best, effect = max(further, key=lambda one: one[0])
    alike = {
        e.place for at, _, e in further if e.physics == effect.physics and odds - at <= AS_LIKELY
    }
    what = effect.title if len(alike) == 1 else f"{effect.type.noun} at one place or another"
    if effect.physics == AttachedResonator.name and len(alike) > 1:  # wherever it is put
        what += " (a support that resonates looks like that)"
    part = 1.0 - case.scale(best) / case.scale(w)
    return f"{says.removesuffix('.')}; {what} would take away {100 * part:.0f} % of it."


def _one_more(h: Hypothesis, part: Hypothesis) -> Effect | None:
    """The one effect that a hypothesis has beside all those of another; None without such."""
    more = h.keys - part.keys
    if len(more) != 1 or not part.keys <= h.keys:
        return None
    return next(e for e in h.effects if e.key in more)
