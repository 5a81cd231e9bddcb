"""``clearance``: contact beyond a gap, one- or two-sided. Tell-tale: resonances rise above a level
at which the gap closes; even harmonics where it is one-sided."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import ABOVE, NonlinearForce, places, write
from cvxupdate.physics.place import Place, at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity, stiffness_unit

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
        return [
            Effect(
                self,
                place,
                NonlinearForce("clearance", rows, ("k", "gap"), (True, True), sides, side),
                (physical("k", stiffness_unit(place)), physical("gap", _unit(place), 1)),
                1,
                ABOVE,
            )
            for rows, place in places(context)
            for sides, side in SIDES
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Gap, side and stiffness."""
        gap, place = values["gap"], effect.place
        action = effect.action
        both = isinstance(action, NonlinearForce) and action.sides == "two"
        toward, moves = "+" if gap >= 0.0 else "−", "turns" if place.turns else "moves"
        if both:
            when = "in either direction"
        elif len(place.nodes) == 2:
            a, b = place.nodes
            when = f"when node {b} {moves} towards {toward}{place.dof} against node {a}"
        else:
            when = f"when it {moves} towards {toward}{place.dof}"
        wide, k = quantity(abs(gap), _unit(place)), quantity(values["k"], stiffness_unit(place))
        return (
            f"{capital(at(place))} two parts touch after a gap of {wide}, {when} (contact "
            f"stiffness {k}); the model has no contact there."
        )


def _unit(place: Place) -> str:
    return "rad" if place.turns else "m"
