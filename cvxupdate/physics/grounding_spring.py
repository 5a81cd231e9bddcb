"""``grounding_spring``: a stiffness between a node and ground. Tell-tale: the lowest modes move
most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import Block
from cvxupdate.fe.elements import Spring
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.compliance import put_spring
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import Draft
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import at_once, dof_rows, small_block, with_block
from cvxupdate.physics.place import Place, at, capital, drive_point
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, 1e5)
UNIT = 0.02  # of the stiffness at its place


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A spring of a problem file."""
    what = "joint" if block.dofs.shape[1] == 2 else "spring to ground"
    put_spring(draft, model, block, e, now["k"] * now["stiffness"], "k", what)


@final
class GroundingSpring(EffectType):
    """A spring to ground."""

    name = "grounding_spring"
    noun = "a spring to ground"
    unlimited = True
    writers = (("spring", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every free DOF that has stiffness or mass."""
        out = []
        for row, node, kind in dof_rows(context.model, KINDS):
            stiffness, mass = context.local(row)
            if stiffness == 0.0 and mass == 0.0:
                continue
            unit = UNIT * stiffness if stiffness > 0.0 else mass * (2 * np.pi * context.bottom) ** 2
            change = ModelChange(
                partial(_grown, context.model, row, node, kind, unit),
                at_once((row,), "K", np.full((1, 1), unit)),
            )
            place = Place(nodes=(node,), dof=kind)
            figures = (physical("k", stiffness_unit(place)),)
            spot = drive_point(place, context.driven)
            out.append(Effect(self, place, change, figures, 1, LIMITS, spot))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Its stiffness; where the force comes in, what it may be."""
        k = quantity(values["k"], stiffness_unit(effect.place))
        stinger = ": the shaker's stinger and suspension" if effect.spot else ""
        return (
            f"{capital(effect.spot or at(effect.place))} the structure is held by a spring of {k} "
            f"that the model does not have{stinger}."
        )


def _grown(model: Model, row: int, node: int, kind: str, unit: float) -> Model:
    block = springs_at(model, [row], kind)
    return with_block(model, block, f"grounding_spring@n{node}.{kind}", "k", LIMITS, unit)


def springs_at(model: Model, rows: Sequence[int], kind: str) -> Block:
    """Springs to ground at DOFs of one kind, of no stiffness yet."""
    dofs, directions = np.array(rows)[:, None], [KINDS.index(kind)]
    return small_block(model, Spring(kind, 1), dofs, directions, "K", np.ones((1, 1)), {"k": 0.0})
