"""``viscous_damper``: a dashpot at a node or between nodes; tell-tale: complex modes, damping of
the modes that move it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import Block
from cvxupdate.fe.elements import Dashpot
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.draft import Draft, kind_of, not_negative
from cvxupdate.physics.effect import RATIOS, RESPONSES, Effect, EffectType, ModelChange
from cvxupdate.physics.growth import at_once, dof_rows, small_block, with_block
from cvxupdate.physics.place import TRANSLATIONS, Place, at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.storeys import storeys
from cvxupdate.physics.units import damper_unit, quantity

LIMITS = (0.0, 1e5)


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A dashpot of a problem file."""
    ends, number = block.dofs[e].tolist(), int(block.ids[e])
    nodes = [draft.end(model, d) for d in ends]
    c = not_negative(number, "c", now["c"] * now["damping"])
    row = {"id": number, "nodes": nodes, "dof": kind_of(model, ends[0]), "c": c}
    draft.put("dashpot", {**row, "group": draft.fresh_group("damper", nodes[0])})
    draft.known[number, "c"] = (number, "c")


@final
class ViscousDamper(EffectType):
    """A dashpot."""

    name = "viscous_damper"
    noun = "a damper"
    damping = True
    told_by = frozenset({RESPONSES, RATIOS})
    writers = (("dashpot", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """To ground at every free translation, across every spring (two-node elements that act
        along one DOF), and across the members of a frame between their corners."""
        model = context.model
        at_nodes = [((row,), kind) for row, _, kind in dof_rows(model, TRANSLATIONS)]
        pairs = dict.fromkeys((*neighbours(model), *storeys(model)))
        across = [((a, b), kind) for a, b, kind in pairs]
        return [self._one(context, rows, kind) for rows, kind in (*at_nodes, *across)]

    def _one(self, context: SearchContext, rows: tuple[int, ...], kind: str) -> Effect:
        model = context.model
        nodes = tuple(int(model.node_ids[model.dof_node[r]]) for r in rows)
        k, m = context.local(rows[0])
        least = 0.02 * np.sqrt(max(k * m, 0.0))
        unit = 0.02 * max(m * 2 * np.pi * context.bottom, least) if m > 0 else 1.0
        single = len(rows) == 1
        pattern = np.ones((1, 1)) if single else np.array([[1.0, -1.0], [-1.0, 1.0]])
        change = ModelChange(
            partial(_grown, model, rows, nodes, kind, pattern, unit),
            at_once(rows, "C", unit * pattern),
        )
        place = Place(nodes=nodes, dof=kind)
        return Effect(self, place, change, (physical("c", damper_unit(place)),), 1, LIMITS)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Its coefficient."""
        c = quantity(values["c"], damper_unit(effect.place))
        return (
            f"{capital(at(effect.place))} a damper of {c} takes out energy; the model does not "
            "have it."
        )


def _grown(
    model: Model,
    rows: tuple[int, ...],
    nodes: tuple[int, ...],
    kind: str,
    pattern: Real,
    unit: float,
) -> Model:
    directions = [KINDS.index(kind)] * len(rows)
    block = small_block(
        model, Dashpot(kind, len(rows)), np.array([rows]), directions, "C", pattern, {"c": 0.0}
    )
    name = "viscous_damper@" + "-".join(str(n) for n in nodes) + kind
    return with_block(model, block, name, "c", LIMITS, unit)


def neighbours(model: Model) -> list[tuple[int, int, str]]:
    """(row, row, kind) of free DOFs joined by a spring element."""
    return sorted(
        {
            (int(a), int(b), KINDS[int(block.direction[0, 0])])
            for block in model.blocks
            if block.kind.name == "spring" and block.dofs.shape[1] == 2
            for a, b in block.dofs.tolist()
            if a >= 0 and b >= 0
        }
    )
