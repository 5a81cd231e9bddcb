"""The likeliest sets without what is hardly there in them.

A search refits what the evidence asks for; what brings two nats more may have a size that nobody
could state. Nothing may rest on that, and then the whole set is lost with it, though the rest of it
stands firmer than anything that is left.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, without
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.judge.soundness import sound, unsound
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.settings import STAYING, STRONG
from cvxupdate.diagnose.types import Key


def sounder(field: Sequence[Weighed], case: Case) -> list[Hypothesis]:
    """Of the likeliest of a field, as far as they are strongly likelier than any that is sound,
    what is left without the effects that are not, fitted from where it is beside them; nothing that
    was tried, or when the time is over."""
    ranked = sorted(((log_odds(w, case), w) for w in field), key=lambda pair: -pair[0])
    tried = {w.hypothesis.keys for w in field}
    firm = (at for at, w in ranked if sound(w.hypothesis, case.evidence))
    least = next(firm, -np.inf) + STRONG / 2.0
    out: list[Hypothesis] = []
    for at, w in ranked:
        if at <= least or len(out) >= STAYING or case.evidence.hurried:
            break
        found = _freed(w.hypothesis, tried, case)
        if found is not None:
            tried.add(found.keys)
            out.append(found)
    return out


def _freed(h: Hypothesis, tried: set[frozenset[Key]], case: Case) -> Hypothesis | None:
    """Sound, one fit after the other; None where that was tried, or leaves nothing."""
    while gone := unsound(h, case.evidence):
        rest = without(case.evidence, h, *gone)
        if rest is None or not rest.effects or rest.keys in tried:
            return None
        found = refitted(case.evidence, rest.onward, "sharp")
        if found is None:
            return None
        h = found
    return h
