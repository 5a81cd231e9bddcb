"""``cubic_stiffness``: a restoring force in the third power of the motion. Tell-tale: resonances
move up (hardening) or down (softening) with the level, odd harmonics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import EITHER, NonlinearForce, places, write
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity


@final
class CubicStiffness(EffectType):
    """A spring that grows stiffer or softer the further it goes."""

    name = "cubic_stiffness"
    noun = "a hardening or softening spring"
    told_by = frozenset({MOTION})
    writers = (("cubic_spring", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force."""
        return [
            Effect(
                self,
                place,
                NonlinearForce("cubic", rows, ("k3",), (False,)),
                (physical("k3", "N·m/rad³" if place.turns else "N/m³"),),
                0,
                EITHER,
            )
            for rows, place in places(context)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Which way, and how much."""
        k3 = values["k3"]
        what, way = ("hardening", "stiffer") if k3 > 0 else ("softening", "softer")
        size = quantity(k3, effect.figures[0].unit)
        return (
            f"{capital(at(effect.place))} there is a {what} spring that the model does not have: "
            f"it grows {way} the further it is moved (a force of {size} times the motion cubed)."
        )
