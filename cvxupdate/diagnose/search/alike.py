"""An explanation carried to the places that are hardly told from its own."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from, without
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.settings import NEIGHBOURS, WALKS
from cvxupdate.diagnose.types import Evidence, Key, Progress, Real, Score, Seed
from cvxupdate.physics.effect import Effect


def elsewhere(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """The best of ``known`` (sharpened, best first) with each effect at places alike in turn, begun
    where it ended: screening takes few of many neighbours, and what is equivalent must be known.
    Where another place is the best one then, those that are alike to it too. All, best first."""
    found = list(known)
    for _ in range(WALKS if known else 0):
        at = found[0].keys
        found = _one_step(evidence, found, progress)
        if found[0].keys == at:
            break
    return found


def _one_step(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    tried = {h.keys for h in known}
    seeds = _seeds(evidence, known[0], tried)
    if seeds and evidence.hurried:
        evidence.leave("places that are hardly told from the best one", len(seeds))
        return list(known)
    if not seeds:
        return list(known)
    level = evidence.levels - 1
    found = entered(evidence, seeds, progress)
    return merged(known, raced(evidence, found, ((level, len(seeds)),), progress))


def _seeds(evidence: Evidence, best: Hypothesis, tried: Collection[frozenset[Key]]) -> list[Seed]:
    """Of each effect other forms where it stands, and the nearest places at which it was not
    ``tried`` yet."""
    out: list[Seed | None] = []
    for k, effect in enumerate(best.effects):
        others = best.keys - {effect.key}
        alike = evidence.alike(best.fit, effect)
        fresh = [e for e in alike if others | {e.key} not in tried]
        forms = [e for e in fresh if e.place == effect.place]
        places = [*forms, *[e for e in fresh if e.place != effect.place][:NEIGHBOURS]]
        rest = without(evidence, best, k) if places else None
        if rest is None:
            continue
        size = _size(best, k)
        context = evidence.context(rest.fit.setting.model)
        theres = [other.on(context) for other in places]
        same = [t for t in theres if t is not None and t.physics == effect.physics]
        unlike = [t for t in theres if t is not None and t.physics != effect.physics]
        scores = [Score(t, 1.0, size, exact=True) for t in same]
        scores += _screened(evidence, rest, unlike) if unlike else []
        out += [seed_from(evidence, rest, s, evidence.levels - 1) for s in scores]
    return [s for s in out if s is not None]


def _size(best: Hypothesis, number: int) -> Real:
    """As parameters of the model, or in the units of a law."""
    effect = best.effects[number]
    if effect.change is not None:
        return best.sizes(number)[: effect.count]
    return np.array([best.values[number][q.name] for q in effect.figures])


def _screened(evidence: Evidence, rest: Hypothesis, wanted: Sequence[Effect]) -> list[Score]:
    """Effects of another type, of the sizes that screening beside the rest gives them."""
    keys = {e.key for e in wanted}
    scores = evidence.first_order(rest.fit, evidence.candidates(rest.fit.setting.model))
    return [replace(s, exact=True) for s in scores if s.effect.key in keys and np.any(s.p)]
