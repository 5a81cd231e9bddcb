"""``grounding_spring`` at a class of supports: all that hold a direction give way, one k; or all
that hold feet from turning, about whatever axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.physics.alike import AlikeChange, owned, with_own
from cvxupdate.physics.compliance import EDGE, RIGID, SOFTEST, write, write_edge
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.given import Points
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.members import STRAIGHT
from cvxupdate.physics.place import ROTATIONS, Place, where
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.released import (
    Held,
    Released,
    edge_shares,
    sheet_sides,
    straight_runs,
    tangent_of,
)
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, SOFTEST)
MOST = 100  # supports of a class
ALONG = " along the edge"
ROCKING = ", about all axes across their members,"


@final
class EqualSupports(EffectType):
    """Supports that give way alike."""

    name = "grounding_spring"
    noun = "the flexibility"
    rig = True
    writers = (("compliance", write), (EDGE, write_edge))

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One for every direction that is held at several nodes, for each straight edge of sheets
        by itself where several are held, and one for feet that rock."""
        return self._of(context, (*classes(context), *edges(context), *feet(context)))

    def at(self, place: Place, context: SearchContext) -> list[Effect]:
        """Only classes that hold there are set free."""
        every = (*classes(context), *edges(context), *feet(context))
        return self._of(context, [held for held in every if _hold(held, place)])

    def _of(self, context: SearchContext, every: Sequence[tuple[Held, ...]]) -> list[Effect]:
        out = []
        for held in every:
            free = Released.of(context, held)
            if len(free.held) < 2 or free.within.diagonal().min() <= 0.0:
                continue
            unit = free.unit
            along = free.along(unit)
            change = AlikeChange(
                partial(_softened, free, unit),
                ((tangent_of(along),),),
                series=True,
                along=along,
                own=0 if free.along_edge else owned({n for n, _ in free.held}),
            )
            kinds = {kind for _, kind in free.held}
            nodes = tuple(dict.fromkeys(n for n, _ in free.held))
            place = Place(nodes=nodes, dof=kinds.pop() if len(kinds) == 1 else None)
            figures = (stiffness("k", stiffness_unit(Place(dof=held[0][1])), unit / RIGID),)
            told = ALONG if free.along_edge else "" if place.dof else ROCKING
            spot = f"of the {len(nodes)} supports{told} at {where(place)}"
            out.append(Effect(self, place, change, figures, 1, LIMITS, spot))
        return out + [self._at(p) for p in Points.of(context) if 1 < len(p.ids) <= MOST]

    def _at(self, points: Points) -> Effect:
        """Where a sheet gives way itself."""
        place = Place(nodes=points.nodes, dof=points.dof)
        softer = partial(points.softer, f"equal_supports@{points.dof}", LIMITS)
        change = ModelChange(softer, ((points.tangent,),), series=True, along=points.along)
        figures = (stiffness("k", stiffness_unit(place), points.rigid),)
        spot = f"of the {len(points.nodes)} supports at {where(place)}"
        return Effect(self, place, change, figures, 1, LIMITS, spot)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """What each of them holds with."""
        unit = stiffness_unit(effect.place) if effect.place.dof else "N·m/rad"
        k = quantity(values["k"], unit)
        share = " on the average, by the length of edge that is its own"
        k += share if ALONG in effect.spot else ""
        return f"Each {effect.spot} gives way: it holds with {k}, while the model holds it rigidly."


def classes(context: SearchContext) -> Iterator[tuple[Held, ...]]:
    """Supports of a direction at several nodes; not where it is held at all nodes, for that is how
    a plane structure is said."""
    every = set(context.model.node_ids.tolist())
    for kind in dict.fromkeys(k for _, k in context.supports):
        held = tuple(dict.fromkeys(h for h in context.supports if h[1] == kind))
        nodes = {n for n, _ in held}
        if 1 < len(nodes) <= MOST and nodes != every:
            yield held


def edges(context: SearchContext) -> Iterator[tuple[Held, ...]]:
    """Of a class the supports on each straight edge of sheets, where they are not all on one: one
    side of a plate may be clamped worse than another. A corner is held by the other side still."""
    for held in classes(context):
        at = {n for n, _ in held}
        runs = straight_runs(sheet_sides(context.model, at))
        for run in runs if len(runs) > 1 else ():
            corners = set().union(*(other & run for other in runs if other is not run))
            inner = run - corners
            if len(inner) > 1 and run != at:
                yield tuple(h for h in held if h[0] in inner)


def feet(context: SearchContext) -> Iterator[tuple[Held, ...]]:
    """Rotations that are held at several nodes, the same ones about each axis, but for that along
    which all members stand there: feet that rock on plates of one kind. Not along edges of sheets,
    where an axis is the edge's."""
    turning = [
        held
        for held in classes(context)
        if held[0][1] in ROTATIONS and not _along_members(context.model, held)
    ]
    nodes = {frozenset(n for n, _ in held) for held in turning}
    edges = any(np.any(edge_shares(context.model, held) != 1.0) for held in turning)
    if len(turning) > 1 and len(nodes) == 1 and not edges:
        yield tuple(h for held in turning for h in held)


def _hold(held: tuple[Held, ...], place: Place) -> bool:
    """Whether supports, or some of them, may be those at a place."""
    kinds = {kind for _, kind in held}
    alike = place.dof in kinds if place.dof else len(kinds) > 1
    return alike and {n for n, _ in held}.issuperset(place.nodes)


def _along_members(model: Model, held: tuple[Held, ...]) -> bool:
    """Whether all members stand at supports along the axis that these hold from turning about: a
    foot rocks, and twists otherwise."""
    axis, at = ROTATIONS.index(held[0][1]), {n for n, _ in held}
    found = False
    for block in model.blocks:
        if block.nodes is None or block.kind.nodes != 2:
            continue
        for a, b in block.nodes:
            if a != b and not at.isdisjoint(model.node_ids[[a, b]].tolist()):
                away = model.xyz[b] - model.xyz[a]
                if abs(away[axis]) < STRAIGHT * float(np.linalg.norm(away)):
                    return False
                found = True
    return found


def _softened(free: Released, unit: float) -> Model:
    kinds = dict.fromkeys(kind for _, kind in free.held)
    model = free.sprung(unit)
    ids = [i for b in model.blocks[-len(kinds) :] for i in b.ids.tolist()]
    nodes = [n for kind in kinds for n, own in free.held if own == kind]
    name = f"equal_supports@{'+'.join(kinds)}"
    grown = append_parameters(model, [limited(name, "a", ids, LIMITS, unit)])
    return grown if free.along_edge else with_own(grown, name, zip(nodes, ids, strict=True))
