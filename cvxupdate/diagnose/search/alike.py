"""An explanation carried to the places that are hardly told from its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from, without
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.types import Evidence, Progress, Score, Seed
from cvxupdate.physics.effect import Effect


def elsewhere(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """The best of ``known`` (sharpened, best first) with each effect at places alike in turn, begun
    where it ended: screening takes few of many neighbours, and what is equivalent must be known.
    All, best first."""
    if not known:
        return list(known)
    tried = {h.keys for h in known}
    seeds = [s for s in _seeds(evidence, known[0]) if s.keys not in tried]
    if seeds and evidence.hurried:
        evidence.leave("places that are hardly told from the best one", len(seeds))
        return list(known)
    if not seeds:
        return list(known)
    level = evidence.levels - 1
    found = entered(evidence, seeds, progress)
    return merged(known, raced(evidence, found, ((level, len(seeds)),), progress))


def _seeds(evidence: Evidence, best: Hypothesis) -> list[Seed]:
    out: list[Seed | None] = []
    for k, effect in enumerate(best.effects):
        places = evidence.alike(best.fit, effect)
        rest = without(evidence, best, k) if places else None
        if rest is None:
            continue
        size = np.array([best.figures[k].values[q.name] for q in effect.figures])
        context = evidence.context(rest.fit.setting.model)
        theres = [other.on(context) for other in places]
        same = [t for t in theres if t is not None and t.physics == effect.physics]
        others = [t for t in theres if t is not None and t.physics != effect.physics]
        scores = [Score(t, 1.0, size, exact=True) for t in same]
        scores += _screened(evidence, rest, others) if others else []
        out += [seed_from(evidence, rest, s, evidence.levels - 1) for s in scores]
    return [s for s in out if s is not None]


def _screened(evidence: Evidence, rest: Hypothesis, wanted: Sequence[Effect]) -> list[Score]:
    """Effects of another type, of the sizes that screening beside the rest gives them."""
    keys = {e.key for e in wanted}
    scores = evidence.first_order(rest.fit, evidence.candidates(rest.fit.setting.model))
    return [replace(s, exact=True) for s in scores if s.effect.key in keys and np.any(s.p)]
