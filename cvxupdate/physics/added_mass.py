"""``added_mass``: a lump at a node, in every active translation (negative: taken off). Friswell and
Mottershead (1995), 3.2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Mass, Term
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import Draft, kind_of
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import at_once, dof_rows, new_ids, with_block
from cvxupdate.physics.place import TRANSLATIONS, Place, at, drive_point
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

LIMITS = (-20.0, 1000.0)  # hundredths of the structure's mass


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A lump in a problem file, held where it has no mass; its group's name is the block's."""
    node, number = draft.end(model, int(block.dofs[e, 0])), int(block.ids[e])
    off = now["m"] < 0.0
    row = {"id": number, "nodes": [node], "m": abs(now["m"]) * now["mass"]}
    row |= {"taken_off": True} if off else {}
    name = block.groups[e] or ("mass taken off" if off else "added mass")
    draft.put("mass", {**row, "group": draft.fresh_group(name, node)})
    here = {kind_of(model, d) for d in block.dofs[e].tolist()}
    silent = [k for k in draft.model["dofs"] if k in TRANSLATIONS and k not in here]
    draft.hold(
        node,
        [k for k in silent if f"n{node}.{k}" not in model.place and not draft.held(node, k)],
    )
    draft.known[number, "m"] = (number, "m")


@final
class AddedMass(EffectType):
    """A lump."""

    name = "added_mass"
    noun = "an added mass"
    writers = (("mass", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One at every node that can translate; the unit is a hundredth of the structure's mass.
        Tell-tale: all modes fall that move the node."""
        model = context.model
        unit = 0.01 * max(model.total_mass(), 1e-12)
        out = []
        for node, rows in translations(model).items():
            dof = KINDS[int(model.dof_kind[rows[0]])] if len(rows) == 1 else None
            change = ModelChange(
                partial(_grown, model, node, rows, unit),
                at_once(rows, "M", unit * np.eye(len(rows))),
            )
            place = Place(nodes=(node,), dof=dof)
            spot = drive_point(place, context.driven)
            figures = (physical("m", "kg"),)
            out.append(Effect(self, place, change, figures, limits=LIMITS, spot=spot))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Put on or taken off; where the force comes in, what it may be."""
        much = quantity(abs(values["m"]), "kg")
        if values["m"] < 0.0:
            return f"The real structure is {much} lighter than the model {at(effect.place)}."
        shaker = ": the shaker's armature or the force cell" if effect.spot else ""
        spot = effect.spot or at(effect.place)
        return f"The real structure carries {much} more than the model {spot}{shaker}."


def translations(model: Model) -> dict[int, list[int]]:
    """Node → rows of its free translations."""
    nodes: dict[int, list[int]] = {}
    for row, node, _ in dof_rows(model, TRANSLATIONS):
        nodes.setdefault(node, []).append(row)
    return nodes


def lumps(model: Model, rows: Sequence[Sequence[int]], group: str = "") -> Block:
    """A block of lumps without mass on the DOFs ``rows`` (e, d), the same directions each."""
    n, d = len(rows), len(rows[0])
    values = {**COMMON, **dict.fromkeys(("m", "Ixx", "Iyy", "Izz"), 0.0)}
    return Block(
        Mass(),
        new_ids(model, n),
        (group,) * n,
        np.array(rows),
        np.array([[int(model.dof_kind[r]) for r in rows[0]]]),
        (Term("M", "m", np.eye(d)[None]),),
        np.zeros(n, dtype=np.int64),
        {k: np.full(n, v) for k, v in values.items()},
    )


def _grown(model: Model, node: int, rows: list[int], unit: float) -> Model:
    block = lumps(model, [rows])
    return with_block(model, block, f"added_mass@n{node}", "m", LIMITS, unit)
