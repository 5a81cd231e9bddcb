"""One of a class that is not like the others.

Each member of a class has a factor of its own, within the usual scatter of such. Where a fit takes
one far beyond that, all fits, and the class seems to have a size that none of its members has: what
it is, is one of them that is loose, or stuck, beside others that are alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import (
    SPRINGS,
    Hypothesis,
    further,
    seeds_from,
    together,
    without,
)
from cvxupdate.diagnose.search.exchange import likeliest
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.settings import ALIKE_STD, EACH, STRAINED
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import CvxupdateError
from cvxupdate.physics.alike import AlikeChange
from cvxupdate.physics.effect import MOTION, Effect


def with_one_unlike(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """The likeliest of ``known`` (sharpened) with one member by itself beside each class whose
    members are further apart than such scatter, refitted with the others alike; of each class the
    few that bring it nearest. Nothing where members are as alike as usual, or of motions, whose
    fits take a simulation each."""
    best = likeliest(known)
    if best is None or evidence.told_by == MOTION:
        return []
    out: list[Hypothesis] = []
    for number, effect in enumerate(best.effects):
        if _strained(best, number):
            progress(f"seeking one that is not like the others of {effect.name}")
            out += _beside(evidence, best, number)
            softest = _softest(evidence, best, number)
            out += [] if softest is None else [softest]
    return out


def _strained(h: Hypothesis, number: int) -> bool:
    effect = h.effects[number]
    if not isinstance(effect.change, AlikeChange):
        return False
    own = h.sizes(number)[effect.count :]
    return bool(np.any(np.abs(own) > STRAINED * ALIKE_STD))


def _beside(evidence: Evidence, best: Hypothesis, number: int) -> list[Hypothesis]:
    effect = best.effects[number]
    alike = _all_alike(evidence, best, number)
    if alike is None:
        return []
    found = evidence.candidates(alike.fit.setting.model, (effect.physics,))
    members = [e for e in further(found, alike) if _one_of(e, effect)]
    sized = evidence.finite_size(alike.fit, alike.fit, alike.effects, members)
    nearest = sorted(sized.scores, key=lambda s: -s.fraction)[:EACH]
    seeds = seeds_from(evidence, alike, nearest, alike.fit.setting.level)
    each = (refitted(evidence, seed, "sharp") for seed in (*seeds, *sized.seeds))
    return [h for h in each if h is not None]


def _softest(evidence: Evidence, best: Hypothesis, number: int) -> Hypothesis | None:
    """A set with the softest support of a class by itself and the others as a class, fitted from
    what each holds with; None where none is far softer. A spring beside only makes one stiffer."""
    effect, own = best.effects[number], best.sizes(number)[best.effects[number].count :]
    nodes = effect.place.nodes
    if effect.physics != SPRINGS or effect.place.dof is None or len(own) != len(nodes):
        return None
    k = int(np.argmin(own))
    bare = without(evidence, best, number) if own[k] < -STRAINED * ALIKE_STD else None
    if bare is None:
        return None
    each = best.values[number]["k"] * (1.0 + own)
    others = nodes[:k] + nodes[k + 1 :]
    found = _released(evidence, bare, (nodes[k],), effect, float(each[k]))
    if found is None:
        return None
    rest = float(np.exp(np.mean(np.log(np.delete(each, k)))))
    whole = _released(evidence, found, others, effect, rest)
    return None if whole is None else refitted(evidence, whole.onward, "sharp")


def _released(
    evidence: Evidence, h: Hypothesis, nodes: tuple[int, ...], like: Effect, k: float
) -> Hypothesis | None:
    """A set with further supports that give way as others do, with a stiffness; None where none can
    be told there."""
    found = evidence.candidates(h.fit.setting.model, (SPRINGS,))
    effect = next(
        (e for e in found if (e.place.nodes, e.place.dof) == (nodes, like.place.dof)), None
    )
    moved = None if effect is None else effect.on(evidence.context(h.fit.setting.model))
    if moved is None or moved.change is None:
        return None
    soft = moved.change.model.parameters[len(h.fit.setting.model.parameters)].unit_size
    whole = together(evidence, h, [moved], np.array([1.0 / (k * soft)]))
    return None if whole is h else whole


def _all_alike(evidence: Evidence, best: Hypothesis, number: int) -> Hypothesis | None:
    """The set as it is with all members of a class alike; None where that is no structure."""
    after = sum(e.columns for e in best.effects[number + 1 :])
    end = len(best.fit.setting.model.parameters) - after
    p = best.fit.p.copy()
    p[end - best.effects[number].columns + best.effects[number].count : end] = 0.0
    try:
        return Hypothesis(best.effects, evidence.evaluated(best.fit.setting, p))
    except CvxupdateError:
        return None


def _one_of(effect: Effect, several: Effect) -> bool:
    """Whether an effect is what a class does, at one of its places; one end of a beam in space,
    too, turns about all axes, of which its place names the first."""
    here, there = effect.place, several.place
    inside = set(here.nodes) <= set(there.nodes) and set(here.elements) <= set(there.elements)
    fewer = len(here.nodes) + len(here.elements) < len(there.nodes) + len(there.elements)
    along = here.dof == there.dof or (there.dof is None and there.elements != ())
    return inside and fewer and len(here.nodes) == 1 and along
