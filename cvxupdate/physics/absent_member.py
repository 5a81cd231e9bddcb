"""``stiffness_change`` down to nothing: a member that the model has and the structure has not, cut,
unbolted or never built. What it weighs goes with what it carries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from cvxupdate.fe.model import Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.factors import Set
from cvxupdate.physics.given import is_given
from cvxupdate.physics.growth import Rates, append_parameters, limited
from cvxupdate.physics.members import STRAIGHT, groups_that_are
from cvxupdate.physics.place import Place, at, capital
from cvxupdate.physics.quantity import factor
from cvxupdate.physics.units import number

LIMITS = (-0.999, 0.0)  # a part is left, so that nodes inside the member stay held
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
    hangs together; a joint is where more than two elements meet, one is held, or two turn off."""
    lines = dict[int, tuple[int, int]]()
    groups: dict[str, set[int]] = {}
    joined: list[tuple[int, ...]] = []  # nodes that an element joins, or one and the ground
    meeting: dict[int, list[int]] = {}
    ground = len(model.node_ids)
    for block in model.blocks:
        if block.is_base or block.nodes is None or not any(t.matrix == "K" for t in block.terms):
            continue
        line = block.nodes.shape[1] == 2 and "length" in block.properties and not is_given(block)
        for i, name, nodes in zip(block.ids.tolist(), block.groups, block.nodes, strict=True):
            ends = tuple(nodes.tolist())
            for n in ends:
                meeting.setdefault(n, []).append(i)
            if line:
                lines[i] = (ends[0], ends[1])
                groups.setdefault(name, set()).add(i)
            else:
                joined.append(ends if len(ends) > 1 else (ends[0], ground))
    free = np.bincount(model.dof_node[model.dof_node < ground], minlength=ground)
    held = {n for n in range(ground) if free[n] < free.max(initial=0)}
    joined += [(n, ground) for n in held]
    runs = _runs(model, lines, meeting, held)
    whole = _parts(ground + 1, joined, lines, ())
    return [
        (run, groups_that_are(run, groups))
        for run in runs
        if _parts(ground + 1, joined, lines, run) == whole + _inside(run, lines)
    ]


def _runs(
    model: Model,
    lines: Mapping[int, tuple[int, int]],
    meeting: Mapping[int, list[int]],
    held: set[int],
) -> Iterator[tuple[int, ...]]:
    """Elements that go straight on into one another."""
    leader = {i: i for i in lines}

    def lead(i: int) -> int:
        while leader[i] != i:
            i = leader[i]
        return i

    for node, some in meeting.items():
        if node in held or len(some) != 2 or not set(some) <= lines.keys():
            continue
        ways = []
        for i in some:
            a, b = lines[i]
            way = model.xyz[b if a == node else a] - model.xyz[node]
            ways.append(way / max(float(np.linalg.norm(way)), 1e-300))
        if float(ways[0] @ ways[1]) < -STRAIGHT:
            leader[lead(some[1])] = lead(some[0])
    runs: dict[int, list[int]] = {}
    for i in lines:
        runs.setdefault(lead(i), []).append(i)
    return (tuple(run) for run in runs.values())


def _parts(
    count: int,
    joined: list[tuple[int, ...]],
    lines: Mapping[int, tuple[int, int]],
    without: tuple[int, ...],
) -> int:
    """Of how many pieces the structure is, ground and lone nodes among them."""
    left = set(without)
    pairs = [(nodes[0], n) for nodes in joined for n in nodes[1:]]
    pairs += [ends for i, ends in lines.items() if i not in left]
    rows, columns = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    return int(connected_components(graph, directed=False)[0])


def _inside(run: tuple[int, ...], lines: Mapping[int, tuple[int, int]]) -> int:
    """Nodes within a run: they go with it."""
    return len(run) - 1
