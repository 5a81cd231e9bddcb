"""``added_mass`` that is no point: a body whose footprint is felt by short waves.

A block bolted to a plate moves with the mean of the plate under it and turns with its slope. To
second order in its size that is its second moment about its middle, however it is shaped; a part of
it on the nodes around says the same, linearly in its unknowns: M = m C + s (N - C), with a unit of
mass on the node in C, and spread evenly over its neighbours in N; s times their mean squared
distance is the second moment. A point in its place comes out too light (0.375 for 0.45 kg on 40 by
40 mm, heard up to waves of 0.2 m).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.fe.parameters import Parameter, Target
from cvxupdate.physics.added_mass import LIMITS, AddedMass, lumps, translations
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.place import Place, at, drive_point
from cvxupdate.physics.quantity import Figure, Quantity, physical
from cvxupdate.physics.units import quantity

SPREAD = "spread"
SIDED = 0.2  # of the further neighbour on one side: how far the one on the other is at least
FELT = 2.0  # deviations from nothing that a second moment of its own must be


@dataclass(frozen=True, eq=False)
class SpreadChange(ModelChange):
    """A lump at ``node``, and how much of it lies on the nodes around."""

    node: int = 0

    @property
    def detail(self) -> tuple[str, ...]:
        """What tells it from a point."""
        return (SPREAD,)

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """At the same node of another model."""
        return spread(context, self.node)


@final
class SpreadLump(EffectType):
    """A lump with a footprint."""

    name = "added_mass"
    noun = "an added mass"
    sought = False  # tried where a point comes near
    writers = AddedMass.writers

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One at every node of beams and sheets that is surrounded."""
        found = [spread(context, node) for node in translations(context.model)]
        return [e for e in found if e is not None]

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        """Whether it may be a point."""
        return values["m"] <= 0.0 or values["J"] <= FELT * deviations["J"]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """How much, where, and how far it reaches."""
        radius = float(np.sqrt(max(values["J"], 0.0) / max(abs(values["m"]), 1e-12)))
        spot = effect.spot or at(effect.place)
        return (
            f"The real structure carries {quantity(values['m'], 'kg')} more than the model {spot}, "
            f"spread over its surroundings (radius of gyration {quantity(radius, 'm')})."
        )


def spread(context: SearchContext, node: int) -> Effect | None:
    """A lump at a node of beams or sheets; None where it has no neighbours on either side that move
    in the same directions."""
    model = context.model
    own, moving = np.flatnonzero(model.node_ids == node), translations(model)
    if not len(own) or node not in moving:
        return None
    kinds = [int(model.dof_kind[r]) for r in moving[node]]
    ids = {int(model.node_ids[n]) for n in _neighbours(model, int(own[0]))}
    near = [n for n in sorted(ids) if [int(model.dof_kind[r]) for r in moving.get(n, ())] == kinds]
    places = model.xyz[[int(np.flatnonzero(model.node_ids == n)[0]) for n in near]]
    arms = places - model.xyz[int(own[0])]
    squares = np.einsum("ij,ij->i", arms, arms)
    if not near or not _surrounded(arms):
        return None
    unit = 0.01 * max(model.total_mass(), 1e-12)
    centre, around = moving[node], [moving[n] for n in near]
    change = SpreadChange(
        partial(_grown, model, node, centre, around, unit),
        _tangent(centre, around, unit),
        node=node,
    )
    dof = KINDS[kinds[0]] if len(kinds) == 1 else None
    place = Place(nodes=(node,), dof=dof)
    spot = drive_point(place, context.driven)
    figures = (physical("m", "kg"), _second_moment(float(squares.sum())))
    return Effect(SpreadLump(), place, change, figures, limits=LIMITS, spot=spot)


def _neighbours(model: Model, own: int) -> set[int]:
    """Places of the nodes that share an element made of something with a node."""
    found: set[int] = set()
    for block in model.blocks:
        if block.nodes is not None and block.nodes.shape[1] > 1 and "rho" in block.properties:
            sharing = block.nodes[np.any(block.nodes == own, axis=1)]
            found.update(sharing.ravel().tolist())
    return found - {own}


def _surrounded(arms: Real) -> bool:
    """Whether neighbours at ``arms`` (n, 3) lie on both sides in every direction in which any lie:
    at an edge a part of a body that lies on them would move its middle."""
    _, extent, directions = np.linalg.svd(arms, full_matrices=False)
    along = arms @ directions[extent > 1e-6 * extent[0]].T
    sides = np.stack([along.max(axis=0), -along.min(axis=0)])
    return bool(np.all(sides.min(axis=0) > SIDED * sides.max(axis=0)))


def _second_moment(squares: float) -> Quantity:
    """Of the second unknown, the mass on one of the nodes whose squared distances add to that."""
    own = physical("J", "kg·m²", 1)

    def convert(m: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
        mass, deviation = own.value(m, q, x, dx, unit)
        return squares * mass, squares * deviation

    return replace(own, convert=convert)


def _tangent(
    centre: list[int], around: list[list[int]], unit: float
) -> tuple[tuple[DerivativeBlock, ...], ...]:
    eye, share = unit * np.eye(len(centre)), 1.0 / len(around)

    def block(rows: list[list[int]], masses: Real) -> DerivativeBlock:
        return DerivativeBlock(np.array(rows), None, np.tile(masses, (len(rows), 1, 1)), None, None)

    return (
        (block([centre], eye),),
        (block([centre], -eye), block(around, share * eye)),
    )


def _grown(
    model: Model, node: int, centre: list[int], around: list[list[int]], unit: float
) -> Model:
    """Lumps at the node and around it; the second parameter moves mass from the one to the
    others."""
    at_node = len(model.blocks)
    for rows in ([centre], around):
        model = replace(model, blocks=(*model.blocks, lumps(model, rows)))
    names = f"added_mass@n{node}", f"added_mass around n{node}"
    own, others = (b.ids.tolist() for b in model.blocks[at_node:])
    share = unit / len(around)
    grown = append_parameters(
        model,
        [
            limited(names[0], "m", own, LIMITS, unit),
            limited(names[1], "m", others, LIMITS, share),
        ],
    )
    *rest, second = grown.parameters
    taken = Target(at_node, np.zeros(1, dtype=np.int64), ("m",), np.array([[-unit]]))
    return grown.with_parameters(
        (
            *rest,
            replace(second, targets=(*second.targets, taken), elements=(*second.elements, *own)),
        )
    )
