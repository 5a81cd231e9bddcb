"""What part of the mismatch each claimed effect explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import without
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.nominal.wanted import usual


def parts_of(case: Case, final: Weighed) -> list[float]:
    """The part of the misfit beyond noise (0 to 1) that each effect explains: what comes back when
    it is taken out and the rest stays; of a single one, what it takes away."""
    h, scale = final.hypothesis, case.scale
    whole = max(scale(case.base), 1e-300)
    if len(h.effects) == 1:
        return [float(np.clip(1.0 - scale(final) / whole, 0.0, 1.0))]
    rests = [without(case.evidence, h, k) for k in range(len(h.effects))]
    back = np.array(
        [np.inf if r is None else max(r.fit.excess - final.fit.excess, 0.0) for r in rests]
    )
    taken = float(np.clip(1.0 - scale(final) / whole, 0.0, 1.0))
    if not np.all(np.isfinite(back)) or back.sum() <= 0.0:
        return [taken if np.isinf(b) else taken / len(rests) for b in back]
    return [taken * float(b) / float(back.sum()) for b in back]


def in_time(case: Case, final: Weighed, told: Sequence[int], parts: Sequence[float]) -> list[int]:
    """Of the effects that are ``told`` all where the search came to its end. Else of what had to be
    sought the one that explains more than all others of it together, if there is one: they were
    added one by one to what the first left, and the exchanges that would have shown what they stand
    for were not made."""
    effects = final.hypothesis.effects
    found = [k for k in told if not usual(case.evidence, effects[k])]
    if not case.evidence.unfinished or len(found) < 2:
        return list(told)
    most = max(parts[k] for k in found)
    clear = most > sum(parts[k] for k in found) - most
    return [k for k in told if k not in found or (clear and parts[k] == most)]
