"""The same said with fewer unknowns, a support without a mass of its own, one class in place of two
effects that are a part of it; or of more of the structure, all its members for one."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import chain, combinations

from cvxupdate.diagnose.hypothesis import PARTS, Hypothesis, seeds_from, without
from cvxupdate.diagnose.settings import WIDER
from cvxupdate.diagnose.types import Evidence, Key, Seed
from cvxupdate.forked import every
from cvxupdate.physics.effect import Effect

SOFTER, GIVES = "stiffness_change", "joint_flexibility"


def plainer(evidence: Evidence, whole: Hypothesis) -> list[Seed]:
    """A fitted set with one effect, or two, said by another one that has fewer unknowns and stands
    at the same places, or by one of the same kind on more elements that does more beside the rest
    as it is; each at the size that does most there."""
    known = evidence.candidates(evidence.model, _names(evidence, whole.effects))

    def instead(indices: tuple[int, ...]) -> list[Seed]:
        gone = [whole.effects[k] for k in indices]
        keys = {c.key for c in known if says(c, gone)} - whole.keys
        more = {c.key for c in known if len(gone) == 1 and covers(c, gone[0])} - whole.keys
        rest = without(evidence, whole, *indices) if keys or more else None
        return [] if rest is None else _sized(evidence, rest, keys, more, gone)

    some = [c for count in (1, 2) for c in combinations(range(len(whole.effects)), count)]
    return list(chain.from_iterable(every(instead, some, evidence.jobs)))


def says(one: Effect, effects: Sequence[Effect]) -> bool:
    """Whether a change of the model says in fewer unknowns what others do: it stands where they do
    together and nowhere else, is of their kind or a part of what they are made of, and acts along
    what they act along, a part of that, or all; or a run of softer elements what a softer one does
    and a joint at its end; or supports without the one that a spring beside it makes rigid again
    what all of them do."""
    if one.change is None or any(e.change is None for e in effects):
        return False
    if _apart(one, effects):
        return True
    if {e.physics for e in effects} == {SOFTER, GIVES}:
        return _run(one, effects)
    nodes = {n for e in effects for n in e.place.nodes}
    elements = {i for e in effects for i in e.place.elements}
    here = (set(one.place.nodes), set(one.place.elements)) == (nodes, elements) != (set(), set())
    part = not elements and one.physics in PARTS
    kind = part or {one.physics} == {e.physics for e in effects}
    along = {None, one.place.dof} & {e.place.dof for e in effects} or one.place.dof is None
    return here and kind and bool(along) and one.count < sum(e.count for e in effects)


def _run(one: Effect, effects: Sequence[Effect]) -> bool:
    """Whether an effect softens the elements that others soften and the one that a joint ends, and
    no more than one beside."""
    elements = {i for e in effects for i in e.place.elements}
    more = set(one.place.elements) - elements
    within = one.physics == SOFTER and elements <= set(one.place.elements)
    return within and len(more) < 2 and one.count < sum(e.count for e in effects)


def _apart(one: Effect, effects: Sequence[Effect]) -> bool:
    """Whether an effect is one of two on the nodes that the other, of its kind, leaves."""
    alike = {(e.physics, e.place.dof, bool(e.place.elements)) for e in (one, *effects)}
    if len(effects) != 2 or len(alike) > 1 or one.place.elements:
        return False
    few, many = sorted((set(e.place.nodes) for e in effects), key=len)
    return few < many and set(one.place.nodes) == many - few


def covers(one: Effect, other: Effect) -> bool:
    """Whether an effect is another one on more elements, or another way at its place."""
    same = one.physics == other.physics and one.place.dof == other.place.dof
    more = set(one.place.elements) > set(other.place.elements) != set()
    more |= one.place == other.place and one.key != other.key
    changes = one.change is not None and other.change is not None
    return same and more and changes and one.count == other.count


def _names(evidence: Evidence, effects: Sequence[Effect]) -> list[str]:
    wanted = {*PARTS, *(e.physics for e in effects if e.change is not None)}
    return [n for n in evidence.names if n in wanted]


def _sized(
    evidence: Evidence,
    rest: Hypothesis,
    keys: Collection[Key],
    more: Collection[Key],
    gone: Sequence[Effect],
) -> list[Seed]:
    """What stands in place of effects, beside the others as they are fitted: all of ``keys``, and
    of ``more`` what does more than what it takes the place of."""
    found = evidence.candidates(rest.fit.setting.model, _names(evidence, gone))
    own = gone[0].key if more else None
    chosen = [c for c in found if c.key in keys or c.key in more or c.key == own]
    sized = evidence.finite_size(rest.fit, rest.fit, rest.effects, chosen)
    does = max((s.fraction for s in sized.scores if s.effect.key == own), default=0.0)
    better = [s for s in sized.scores if s.effect.key in more and s.fraction > does]
    better.sort(key=lambda s: -s.fraction)
    scores = [s for s in sized.scores if s.effect.key in keys] + better[:WIDER]
    seeds = seeds_from(evidence, rest, scores, rest.fit.setting.level)
    return [*seeds, *(s for s in sized.seeds if s.effects[-1].key != own)]
