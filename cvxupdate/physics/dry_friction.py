"""``dry_friction``: Coulomb friction. Tell-tale: damping that falls with the level, hardly any
motion at small ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import ABOVE, NonlinearForce, places, write
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity


@final
class DryFriction(EffectType):
    """A slider."""

    name = "dry_friction"
    noun = "dry friction"
    told_by = frozenset({MOTION})
    writers = (("friction", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force."""
        return [
            Effect(
                self,
                place,
                NonlinearForce("friction", rows, ("force",), (True,)),
                (physical("force", "N·m" if place.turns else "N"),),
                1,
                ABOVE,
            )
            for rows, place in places(context)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The force that it takes to slide."""
        force = quantity(values["force"], effect.figures[0].unit)
        return (
            f"{capital(at(effect.place))} parts rub on one another: dry friction of {force} holds "
            "them up to that force and brakes them beyond; the model does not have it."
        )
