"""The same said with fewer unknowns: a support without a mass of its own, one class in place of two
effects that are a part of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations

from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from, without
from cvxupdate.diagnose.types import Evidence, Key, Seed
from cvxupdate.physics.effect import Effect

PARTS = ("added_mass", "grounding_spring")  # what supports, shakers and fixtures are made of


def plainer(evidence: Evidence, whole: Hypothesis) -> list[Seed]:
    """A fitted set with one effect, or two, said by another one that has fewer unknowns and stands
    at the same places, at the size that does most beside the rest."""
    known = evidence.candidates(evidence.model, _names(evidence, whole.effects))
    out: list[Seed] = []
    for count in (1, 2):
        for indices in combinations(range(len(whole.effects)), count):
            gone = [whole.effects[k] for k in indices]
            keys = {c.key for c in known if says(c, gone)} - whole.keys
            rest = without(evidence, whole, *indices) if keys else None
            out += [] if rest is None else _sized(evidence, rest, keys, gone)
    return out


def says(one: Effect, effects: Sequence[Effect]) -> bool:
    """Whether a change of the model says in fewer unknowns what others do: it stands where they do
    together and nowhere else, is of their kind or a part of what they are made of, and acts along
    what they act along, or along all."""
    if one.change is None or any(e.change is None for e in effects):
        return False
    nodes = {n for e in effects for n in e.place.nodes}
    elements = {i for e in effects for i in e.place.elements}
    here = (set(one.place.nodes), set(one.place.elements)) == (nodes, elements) != (set(), set())
    part = not elements and one.physics in PARTS
    kind = part or {one.physics} == {e.physics for e in effects}
    along = one.place.dof is None or one.place.dof in {e.place.dof for e in effects}
    return here and kind and along and one.count < sum(e.count for e in effects)


def _names(evidence: Evidence, effects: Sequence[Effect]) -> list[str]:
    wanted = {*PARTS, *(e.physics for e in effects if e.change is not None)}
    return [n for n in evidence.names if n in wanted]


def _sized(
    evidence: Evidence, rest: Hypothesis, keys: Collection[Key], gone: Sequence[Effect]
) -> list[Seed]:
    """What stands in place of effects, beside the others as they are fitted."""
    found = evidence.candidates(rest.fit.setting.model, _names(evidence, gone))
    chosen = [c for c in found if c.key in keys]
    sized = evidence.finite_size(rest.fit, rest.fit, rest.effects, chosen)
    seeds = seeds_from(evidence, rest, sized.scores, rest.fit.setting.level)
    return [*seeds, *sized.seeds]
