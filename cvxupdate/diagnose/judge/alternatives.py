"""What stands at the same place, and what may stand for an effect."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Figures, Hypothesis
from cvxupdate.diagnose.settings import SIZED
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import Place


def equivalents(
    effect: Effect, best: Hypothesis, near: Sequence[Hypothesis]
) -> list[tuple[Effect, int]]:
    """What may stand for ``effect``: the odd one out of each rival that shares all other effects
    with the best (the same elsewhere, where it has something beside), and which of ``near`` has it
    first; none of a rival that has the effect itself, in any form, and something beside."""
    rest = best.keys - {effect.key}
    out: dict[object, tuple[Effect, int]] = {}
    for number, rival in enumerate(near):
        if not rest <= rival.keys or any(_same(other, effect) for other in rival.effects):
            continue
        others = [e for e in rival.effects if e.key not in best.keys]
        alike = [e for e in others if e.physics == effect.physics]
        for other in alike or others:
            out.setdefault(other.key, (other, number))
    return list(out.values())


def spread_over(
    number: int, best: Hypothesis, alike: Sequence[Effect], near: Sequence[tuple[Hypothesis, float]]
) -> dict[str, float]:
    """Deviations of the figures of effect ``number`` of the best hypothesis about what it has, the
    places ``alike`` taken with it: its own, and those of each of ``near`` that differs by nothing
    but such a place and tells its size there, as many times less likely as stands beside it."""
    effect, own = best.effects[number], best.figures[number]
    rest, places = best.keys - {effect.key}, {e.key for e in alike}
    whole, squares = 1.0, {name: std**2 for name, std in own.deviations.items()}
    for rival, behind in near:
        other = rival.keys - rest
        if not (rest <= rival.keys and len(other) == 1 and other <= places):
            continue
        figures = next(
            f for e, f in zip(rival.effects, rival.figures, strict=True) if e.key in other
        )
        if any(figures.deviations[name] > abs(figures.values[name]) for name in squares):
            continue  # nearly rigid: what has no upper limit has no mean
        whole += 1.0 / behind
        for name, value in own.values.items():
            off = figures.values[name] - value
            squares[name] += (off**2 + figures.deviations[name] ** 2) / behind
    return {name: float(np.sqrt(square / whole)) for name, square in squares.items()}


def of_a_change(effect: Effect, figures: Figures, spread: dict[str, float]) -> dict[str, float]:
    """Deviations ``spread`` of a change from a reference state, with what the model makes of every
    change: shapes that are off bend it in all modes alike, and no further mode tells."""
    nothing = {q.name: q.nothing or 0.0 for q in effect.figures}
    sizes = {name: abs(figures.values[name] - at) for name, at in nothing.items()}
    return {name: float(np.hypot(std, SIZED * sizes[name])) for name, std in spread.items()}


def _same(one: Effect, other: Effect) -> bool:
    return (one.physics, one.place) == (other.physics, other.place)


def overlapping(a: Place, b: Place, model: Model | None = None) -> bool:
    """Whether two places share most of their elements, or a node; with ``model`` also a few
    elements with nodes that are theirs."""
    if a.elements and b.elements:
        common = len(set(a.elements) & set(b.elements))
        return common >= 0.5 * len(set(a.elements) | set(b.elements))
    if model is not None and (a.elements or b.elements) and (a.nodes or b.nodes):
        few, nodes = (a, b) if a.elements else (b, a)
        ends = nodes_of(model, few.elements)
        close = len(ends) <= len(nodes.nodes) + 1
        return bool(nodes.nodes) and close and set(nodes.nodes) <= ends
    return bool(set(a.nodes) & set(b.nodes)) and a.dof == b.dof


def nodes_of(model: Model, elements: Sequence[int]) -> set[int]:
    """Numbers of the nodes that elements stand on, wholly held ones left out."""
    wanted = np.array(elements, dtype=np.int64)
    found: set[int] = set()
    for block in model.blocks:
        used = block.nodal[np.isin(block.ids, wanted)]
        found.update(model.node_ids[model.dof_node[used[used >= 0]]].tolist())
    return found


def nodes_at(effect: Effect, model: Model) -> frozenset[int]:
    """The nodes of an effect's place, or those that its elements stand on, or on which it acts."""
    on = () if effect.change is None else effect.change.nodes
    return frozenset(effect.place.nodes or nodes_of(model, effect.place.elements) or on)


def extent(nodes: Collection[int], model: Model) -> float:
    """How far some nodes extend, in parts of the structure's extent; infinite where there are
    none."""
    xyz = model.xyz
    own = xyz[np.isin(model.node_ids, list(nodes))]
    if not len(own):
        return np.inf
    whole = float(np.linalg.norm(np.ptp(xyz, axis=0)))
    return float(np.linalg.norm(np.ptp(own, axis=0))) / max(whole, 1e-12)


def has(h: Hypothesis, effect: Effect, model: Model) -> bool:
    """Whether a hypothesis has an effect where ``effect`` stands."""
    place = effect.place
    return any(
        place == p
        or overlapping(place, p, model)
        or (bool(place.elements) and set(place.elements) <= set(p.elements))
        for p in (other.place for other in h.effects)
    )
