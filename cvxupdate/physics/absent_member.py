"""``stiffness_change`` down to nothing: a member that the model has and the structure has not, cut,
unbolted or never built. What it weighs goes with what it carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.factors import Set
from cvxupdate.physics.given import is_given
from cvxupdate.physics.growth import Rates, append_parameters, limited
from cvxupdate.physics.members import STRAIGHT, chained, groups_that_are
from cvxupdate.physics.place import Place, at, capital
from cvxupdate.physics.quantity import factor
from cvxupdate.physics.units import number

LIMITS = (-0.999, 0.0)  # a part is left, so that nodes inside the member stay held
MOST = 400  # members that are looked at: each is taken out once
GONE = 0.2  # of stiffness and mass: with more it is a member that is softer


@dataclass(frozen=True, eq=False)
class Absence(ModelChange):
    """Of a whole member."""

    @property
    def detail(self) -> tuple[str, ...]:
        """What tells it from a member that is softer."""
        return ("absent",)

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """Where next to nothing is left."""
        return values["factor"] <= GONE


@final
class AbsentMember(EffectType):
    """A member that is not there."""

    name = "stiffness_change"
    noun = "a missing member"
    total = True

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Every member between joints that the structure can stand without."""
        model = context.model
        rates = Rates.of(model, "whole")
        out = []
        for k, (ids, groups) in enumerate(spare_members(model)):
            tangent = rates.tangent(ids)
            wanted = [limited(f"absent@{k}", "whole", ids, LIMITS)]
            grow = partial(append_parameters, model, wanted)
            change = Absence(grow, (tangent,), ids)
            place = Place(elements=ids, groups=groups)
            out.append(Effect(self, place, change, (factor(),), 0, LIMITS))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """That it carries nothing and weighs nothing."""
        left = max(values["factor"], 0.0)
        return (
            f"{capital(at(effect.place))} the member is missing or cut: {number(100 * left, 2)} % "
            "of its stiffness and mass are left."
        )


def spare_members(model: Model) -> list[Set]:
    """(element numbers, groups) of the lines between joints without which the structure still
    hangs together; a joint is where more than two elements meet, one is held, or two turn off. None
    of models with more than `MOST` such lines."""
    lines = dict[int, tuple[int, int]]()
    groups: dict[str, set[int]] = {}
    joined: list[tuple[int, int]] = []  # nodes that other elements join, or one and the ground
    meeting: dict[int, list[int]] = {}
    ground = len(model.node_ids)
    for block in model.blocks:
        if block.is_base or block.nodes is None or not any(t.matrix == "K" for t in block.terms):
            continue
        line = block.nodes.shape[1] == 2 and "length" in block.properties and not is_given(block)
        for i, name, nodes in zip(block.ids.tolist(), block.groups, block.nodes, strict=True):
            ends = nodes.tolist()
            for n in ends:
                meeting.setdefault(n, []).append(i)
            if line:
                lines[i] = (ends[0], ends[1])
                groups.setdefault(name, set()).add(i)
            else:
                joined += [(ends[0], n) for n in (ends[1:] or [ground])]
    held = _held(model)
    joined += [(n, ground) for n in held]
    runs = _runs(model, lines, meeting, held)
    if len(runs) > MOST:
        return []
    ids, ends = np.array([*lines]), np.array([*lines.values(), *joined]).reshape(-1, 2)
    whole = _pieces(ends, ground + 1)
    spare = []
    for run in runs:
        left = np.append(~np.isin(ids, run), np.ones(len(joined), dtype=bool))
        inside = len(run) - 1  # nodes that go with it
        if _pieces(ends[left], ground + 1) == whole + inside:
            spare.append((run, groups_that_are(run, groups)))
    return spare


def _held(model: Model) -> set[int]:
    """Places of the nodes that are held in any direction in which others may move."""
    kinds: dict[int, set[int]] = {n: set() for n in range(len(model.node_ids))}
    for node, kind in zip(model.dof_node.tolist(), model.dof_kind.tolist(), strict=True):
        if node in kinds and kind < len(KINDS):
            kinds[node].add(kind)
    every = set().union(*kinds.values())
    return {n for n, own in kinds.items() if own < every}


def _runs(
    model: Model,
    lines: Mapping[int, tuple[int, int]],
    meeting: Mapping[int, list[int]],
    held: set[int],
) -> list[tuple[int, ...]]:
    """Elements that go straight on into one another."""
    pairs = []
    for node, some in meeting.items():
        if node in held or len(some) != 2 or not set(some) <= lines.keys():
            continue
        ways = []
        for i in some:
            a, b = lines[i]
            way = model.xyz[b if a == node else a] - model.xyz[node]
            ways.append(way / max(float(np.linalg.norm(way)), 1e-300))
        if float(ways[0] @ ways[1]) < -STRAIGHT:
            pairs.append((some[0], some[1]))
    return chained(lines, pairs)


def _pieces(ends: Index, count: int) -> int:
    """Of how many pieces ``count`` nodes are that are joined in pairs (n, 2)."""
    graph = sp.coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    return int(connected_components(graph, directed=False)[0])
