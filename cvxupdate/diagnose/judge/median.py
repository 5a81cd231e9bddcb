"""The set of all effects that are likelier there than not (the median probability model; Barbieri
and Berger 2004): where sets are many and none stands out, it foretells best of all.

A search refits what stands beside sets and in place of their effects. Where the likeliest sets have
one thing in common, and each another one beside, what they have in common may never have been
fitted by itself.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, without
from cvxupdate.diagnose.judge.acceptance import (
    Case,
    Weighed,
    better,
    credible,
    needs_several,
    refuted,
)
from cvxupdate.diagnose.judge.posterior import log_odds, weights
from cvxupdate.diagnose.judge.soundness import sound
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.types import Key

LIKELIER = 0.5  # than not


def median(field: Sequence[Weighed], case: Case) -> Hypothesis | None:
    """That of a field, fitted from the likeliest set that has all of it; None where it was fitted,
    or is nothing, or no set has all of it."""
    keys = _likelier(field, case)
    having = [w for w in field if keys <= w.hypothesis.keys]
    if not keys or not having or any(w.hypothesis.keys == keys for w in having):
        return None
    h = max(having, key=lambda w: log_odds(w, case)).hypothesis
    others = [k for k, e in enumerate(h.effects) if e.key not in keys]
    rest = without(case.evidence, h, *others)
    return None if rest is None else refitted(case.evidence, rest.onward, "sharp")


def in_common(
    final: Weighed, tried: Sequence[Weighed], field: Sequence[Weighed], case: Case
) -> Weighed:
    """What was decided; or, where some effect of it is not likelier there than not, the set of
    those that are, if that was ``tried``, can be believed and is no larger."""
    keys = _likelier(field, case)
    if final.hypothesis.keys <= keys or len(keys) > len(final.hypothesis.effects):
        return final
    same = (w for w in tried if w.hypothesis.keys == keys)
    return next((w for w in same if _stands(w, case)), final)


def likelier_part(final: Weighed, tried: Sequence[Weighed], case: Case) -> Weighed:
    """What was decided; or the likeliest part of it that is likelier and can be believed: a larger
    set may have led to what sets have in common, of which a part explains by itself."""
    own, keys = log_odds(final, case), final.hypothesis.keys
    parts = [w for w in tried if w.hypothesis.keys < keys and log_odds(w, case) > own]
    parts.sort(key=lambda w: -log_odds(w, case))
    return next((w for w in parts if _stands(w, case)), final)


def _stands(w: Weighed, case: Case) -> bool:
    if not sound(w.hypothesis, case.evidence) or refuted(w, case) or not credible(w, case):
        return False
    several = len(w.hypothesis.effects) > 1
    return needs_several(w, None, case) if several else better(w, case.base, case)


def _likelier(field: Sequence[Weighed], case: Case) -> frozenset[Key]:
    """Effects that are likelier there than not."""
    if not field or case.damping_only:
        return frozenset()
    parts: dict[Key, float] = defaultdict(float)
    for w, likely in zip(field, weights(field, case).tolist(), strict=True):
        for key in w.hypothesis.keys:
            parts[key] += likely
    return frozenset(key for key, part in parts.items() if part > LIKELIER)
