"""``quadratic_damping``: a force in |v|v, as of a fluid. Tell-tale: damping that grows with the
level."""

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
class QuadraticDamping(EffectType):
    """A damper whose force grows with the square of the velocity."""

    name = "quadratic_damping"
    noun = "damping that grows with the square of the velocity"
    told_by = frozenset({MOTION})
    writers = (("quadratic_damper", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force."""
        return [
            Effect(
                self,
                place,
                NonlinearForce("quadratic", rows, ("c2",), (True,)),
                (physical("c2", "N·m·s²/rad²" if place.turns else "N·s²/m²"),),
                1,
                ABOVE,
            )
            for rows, place in places(context)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Its coefficient."""
        c2 = quantity(values["c2"], effect.figures[0].unit)
        return (
            f"{capital(at(effect.place))} something brakes with the square of the velocity, as a "
            f"fluid does ({c2}); the model does not have it."
        )
