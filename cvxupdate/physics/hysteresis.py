"""``hysteresis``: a spring in series with a slider (Jenkin 1922): sticks, slips, and remembers.
Tell-tale: softer and more damped as the level grows, then less damped again."""

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
class Hysteresis(EffectType):
    """A joint that sticks and slips."""

    name = "hysteresis"
    noun = "a joint that sticks and slips"
    told_by = frozenset({MOTION})
    writers = (("jenkins", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force."""
        return [
            Effect(
                self,
                place,
                NonlinearForce("jenkins", rows, ("k", "force"), (True, True)),
                (
                    physical("k", "N·m/rad" if place.turns else "N/m"),
                    physical("force", "N·m" if place.turns else "N", 1),
                ),
                1,
                ABOVE,
            )
            for rows, place in places(context)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Stiffness while it sticks, and the force at which it slips."""
        k, force = (quantity(values[q.name], q.unit) for q in effect.figures)
        return (
            f"{capital(at(effect.place))} a joint sticks like a spring of {k} and slips at "
            f"{force}, so that its force depends on where it came from; the model "
            "does not have it."
        )
