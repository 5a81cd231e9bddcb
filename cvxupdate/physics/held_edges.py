"""``grounding_spring`` along an edge: sheets that a model hinges on their supports are riveted or
welded to something that does not let them turn freely.

A straight edge of sheets on supports, free to turn about itself in the model, turns against springs
of one stiffness for each metre: at its nodes, each with the part of the edge that is its own.
Tell-tale: modes with bends at that edge rise, the lowest most.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter, Target
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import parallel
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.grounding_spring import LIMITS, UNIT, springs_at, write
from cvxupdate.physics.growth import at_once
from cvxupdate.physics.place import ROTATIONS, TRANSLATIONS, Place, where
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.released import PARALLEL, edge_shares, sheet_sides, straight_runs
from cvxupdate.physics.units import quantity, stiffness_unit

FEWEST, MOST = 3, 100  # nodes of an edge


@final
class HeldEdges(EffectType):
    """Springs of one stiffness a metre against the turning of an edge."""

    name = "grounding_spring"
    noun = "springs against turning"
    unlimited = True
    rig = True
    writers = (("spring", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every straight edge of sheets whose nodes are all supported and may all turn about
        it."""
        out = []
        for nodes, kind in _edges(context):
            rows = [context.model.place[f"n{n}.{kind}"] for n in nodes]
            stiff = float(np.mean([context.local(r)[0] for r in rows]))
            if stiff <= 0.0:
                continue
            shares = edge_shares(context.model, [(n, kind) for n in nodes])
            unit, n = UNIT * stiff, len(rows)
            change = ModelChange(
                partial(_grown, context.model, rows, kind, unit * shares),
                at_once(rows, "K", unit * np.diag(shares)),
                along=parallel(np.array(rows), np.eye(n), unit * shares),
            )
            place = Place(nodes=tuple(nodes), dof=kind)
            figures = (physical("k", stiffness_unit(place)),)
            out.append(Effect(self, place, change, figures, 1, LIMITS, f"at {where(place)}"))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The stiffness at a node, on the average."""
        k = quantity(values["k"], stiffness_unit(effect.place))
        return (
            f"The edge {effect.spot} turns against springs of {k} a node on the average, by the "
            "length of edge that is its own, while the model lets it turn freely."
        )


def _edges(context: SearchContext) -> Iterator[tuple[list[int], str]]:
    """Nodes of a straight edge, in order, and the rotation about it."""
    model = context.model
    held = {n for n, k in context.supports if k in TRANSLATIONS}
    sides = sheet_sides(model, held)
    index = {int(n): i for i, n in enumerate(model.node_ids.tolist())}
    for run in straight_runs(sides):
        xyz = np.array([model.xyz[index[n]] for n in run])
        along = np.ptp(xyz, axis=0)
        axis = int(np.argmax(along))
        kind = ROTATIONS[axis]
        straight = along[axis] >= PARALLEL * float(np.linalg.norm(along)) > 0.0
        if not straight or not FEWEST <= len(run) <= MOST:
            continue
        nodes = sorted(run, key=lambda n: float(model.xyz[index[n]][axis]))
        if all(f"n{n}.{kind}" in model.place for n in nodes):
            yield nodes, kind


def _grown(model: Model, rows: list[int], kind: str, units: Real) -> Model:
    block = springs_at(model, rows, kind)
    number, ids = len(model.blocks), tuple(block.ids.tolist())
    q = Parameter(
        f"held_edge@n{model.node_ids[model.dof_node[rows[0]]]}.{kind}.k",
        "k",
        (Target(number, np.arange(len(rows)), ("k",), units[None]),),
        *LIMITS,
        0.0,
        float(units.mean()),
        stiffness_unit(Place(dof=kind)),
        ids,
        None,
    )
    wider: Model = replace(model, blocks=(*model.blocks, block))
    return wider.with_parameters((*wider.parameters, q))
