"""``clearance``: contact beyond a gap, one- or two-sided. Tell-tale: resonances rise above a level
at which the gap closes; even harmonics where it is one-sided."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import ABOVE, NonlinearForce, places, write
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

SIDES = (("one", 1), ("one", -1), ("two", 1))


@final
class Clearance(EffectType):
    """A stop or free play."""

    name = "clearance"
    noun = "a gap that closes"
    told_by = frozenset({MOTION})
    writers = (("clearance", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force, in contact on either side or on both."""
        figures = (physical("k", "N/m"), physical("gap", "m", 1))
        return [
            Effect(
                self,
                place,
                NonlinearForce("clearance", rows, ("k", "gap"), (True, True), sides, side),
                figures,
                1,
                ABOVE,
            )
            for rows, place in places(context)
            if not place.turns
            for sides, side in SIDES
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Gap, side and stiffness."""
        gap, place = values["gap"], effect.place
        action = effect.action
        both = isinstance(action, NonlinearForce) and action.sides == "two"
        toward = "+" if gap >= 0.0 else "−"
        if both:
            when = "in either direction"
        elif len(place.nodes) == 2:
            a, b = place.nodes
            when = f"when node {b} moves towards {toward}{place.dof} against node {a}"
        else:
            when = f"when it moves towards {toward}{place.dof}"
        return (
            f"{capital(at(place))} two parts touch after a gap of {quantity(abs(gap), 'm')}, "
            f"{when} (contact stiffness {quantity(values['k'], 'N/m')}); the model has no contact "
            "there."
        )
