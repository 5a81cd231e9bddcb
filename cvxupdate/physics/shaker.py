"""What a shaker brings to where it drives: armature or force cell, stinger and suspension
(``flexible_support`` at the drive point; Ewins 2000, 3.3). Moved to another place, it takes them
along, so the structure is another one there: masses and springs at the drive point may stay or go
with the drive, which recordings from one place alone cannot tell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import Block
from cvxupdate.fe.elements import Spring
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.added_mass import AddedMass, lumps, translations
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import RESPONSES, Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, at_once, limited, small_block
from cvxupdate.physics.place import DRIVE_POINT, Place, channel_place, drive_point
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

LIGHTEST = 0.01  # of the structure's mass: the unit of a shaker's
SOFTEST = 0.02  # of the stiffness where it drives: the unit of its stinger's
LIMITS = (0.0, 1000.0)
MOST = 2  # drives: shakers act at few places, a hammer that goes from place to place is none
PLACES = 4  # to which one shaker is moved; a hammer goes to more, and brings nothing
WITH_DRIVE = " with the drive"  # in the name of a parameter that acts wherever the drive is
TRAVELS = ", and wherever else the drive is"


@final
class ShakerAttachment(EffectType):
    """A mass and a spring to ground where a drive is."""

    name = "flexible_support"
    noun = "a shaker with mass and stiffness"
    rig = True
    sought = False  # by themselves a mass and a spring are
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At each drive that acts along an axis, where they are few and drive together, or there is
        but one (else `DriveMass`). Tell-tale: where the force comes in, the structure is heavier
        and stiffer."""
        few = len(context.forces) <= MOST and not context.apart
        drives = context.forces if few else ()
        return [e for label in drives if (e := self._at(label, context)) is not None]

    def _at(self, label: str, context: SearchContext) -> Effect | None:
        model, there = context.model, channel_place(label)
        node, row = there.nodes[0], model.place.get(label, -1)
        rows = translations(model).get(node, [])
        mass = LIGHTEST * max(model.total_mass(), 1e-12)
        if row not in rows:
            return None
        stiffness, inertia = context.local(row)
        slow = inertia * (2.0 * np.pi * context.bottom) ** 2
        stiff = SOFTEST * stiffness if stiffness > 0.0 else slow
        if stiff <= 0.0:
            return None
        tangent = (
            *at_once(rows, "M", mass * np.eye(len(rows))),
            *at_once((row,), "K", np.full((1, 1), stiff)),
        )
        change = ModelChange(partial(_grown, model, node, rows, row, (mass, stiff)), tangent)
        figures = (physical("m", "kg"), physical("k", "N/m", 1))
        place = Place(nodes=(node,), dof=there.dof)
        return Effect(self, place, change, figures, 1, LIMITS, drive_point(place, (label,)))

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Mass and stiffness."""
        return (
            f"The shaker acts on the structure {effect.spot}: with a mass of "
            f"{quantity(values['m'], 'kg')} and a spring of {quantity(values['k'], 'N/m')}, which "
            "the model does not have."
        )


@final
class DriveMass(EffectType):
    """A lump wherever the drive is: force cell, stud and armature of one shaker that went from
    place to place."""

    name = "added_mass"
    noun = "a mass that goes with the drive"
    rig = True
    sought = False  # screening and finite sizes know it where it stands in the model alone
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """The lump at the first of several drives that act one at a time. Tell-tale: modes are
        lower by as much as the place that is driven moves in them, in each recording by its own."""
        drives = context.forces if context.apart and len(context.forces) <= PLACES else ()
        nodes = {channel_place(label).nodes for label in drives[:1]}
        lumped = [e for e in AddedMass().candidates(context) if e.place.nodes in nodes and e.spot]
        return [with_drive(e) for e in lumped]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """As of a lump."""
        return AddedMass().says(effect, values)


def _grown(model: Model, node: int, rows: list[int], row: int, units: tuple[float, float]) -> Model:
    heavy = lumps(model, [rows])
    grown = replace(model, blocks=(*model.blocks, heavy))
    axis = int(model.dof_kind[row])
    spring: Block = small_block(
        grown, Spring(KINDS[axis], 1), np.array([[row]]), [axis], "K", np.ones((1, 1)), {"k": 0.0}
    )
    grown = replace(grown, blocks=(*grown.blocks, spring))
    named = zip(("m", "k"), (heavy, spring), units, strict=True)
    wanted = [
        limited(f"shaker@n{node}.{of}", of, block.ids.tolist(), LIMITS, unit)
        for of, block, unit in named
    ]
    return append_parameters(grown, wanted)


def parts_of(effect: Effect) -> tuple[str, ...]:
    """The effects that a shaker's attachment is made of, in the order of its unknowns and in the
    same units; none of others."""
    return ("added_mass", "grounding_spring") if isinstance(effect.type, ShakerAttachment) else ()


def at_drive(effect: Effect) -> bool:
    """Whether it stands where the force comes in, and may be the shaker's."""
    return effect.change is not None and effect.spot.startswith(DRIVE_POINT)


def goes_with_drive(name: str) -> bool:
    """Whether a parameter of that name acts wherever the drive is."""
    return WITH_DRIVE in name


@dataclass(frozen=True, eq=False)
class Travelling(ModelChange):
    """A change at the drive point that goes with the drive. Where the drive is, it is the same."""

    @property
    def detail(self) -> tuple[str, ...]:
        """What tells it from one that stays."""
        return (WITH_DRIVE,)

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """Of the candidate that stays."""
        stays = (effect.physics, effect.place)
        near = effect.type.at(effect.place, context)
        found = next((e for e in near if e.key == stays), None)
        return None if found is None else with_drive(found)


def goes(effect: Effect) -> bool:
    """Whether it goes with the drive."""
    return isinstance(effect.change, Travelling)


def with_drive(effect: Effect) -> Effect:
    """A change at the drive point as one that goes with the drive; as it is where it goes already,
    or is of a kind that stays: a lump with a footprint is no shaker."""
    change = effect.change
    if type(change) is not ModelChange:
        return effect
    same = {f.name: getattr(change, f.name) for f in fields(change)}
    action = Travelling(**{**same, "grow": partial(_marked, change)})
    return replace(effect, action=action, spot=f"{effect.spot}{TRAVELS}")


def _marked(change: ModelChange) -> Model:
    return marked(change.model, range(-change.count, 0))


def marked(model: Model, which: Sequence[int]) -> Model:
    """The model with the names of some of its parameters saying that they go with the drive."""
    parameters = list(model.parameters)
    for k in which:
        parameters[k] = replace(parameters[k], name=f"{parameters[k].name}{WITH_DRIVE}")
    return model.with_parameters(parameters)
