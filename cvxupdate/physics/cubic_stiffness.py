"""``cubic_stiffness``: a spring that is not straight. A restoring force in the third power of the
motion, tell-tale: resonances move up (hardening) or down (softening) with the level, odd harmonics;
or in its square (an arch, a cable that sags, a preloaded contact), tell-tale: even harmonics and a
motion that wanders off to one side as the level grows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import EITHER, NonlinearForce, places, write
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

EVEN = "even"
UNITS = {"k3": ("N/m³", "N·m/rad³"), EVEN: ("N/m²", "N·m/rad²")}  # of a motion, of an angle


@final
class CubicStiffness(EffectType):
    """A spring that grows stiffer or softer the further it goes, or the further one way."""

    name = "cubic_stiffness"
    noun = "a hardening or softening spring"
    told_by = frozenset({MOTION})
    writers = (("cubic_spring", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every place of an internal force; then those whose force goes with the square."""
        return [
            Effect(
                self,
                place,
                NonlinearForce("cubic", rows, (name,), (False,)),
                (physical(name, units[place.turns]),),
                0,
                EITHER,
            )
            for name, units in UNITS.items()
            for rows, place in places(context)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Which way, and how much."""
        (name,) = values
        size = quantity(values[name], effect.figures[0].unit)
        there = f"{capital(at(effect.place))} there is a"
        if name == EVEN:
            stiff, soft = ("+", "−") if values[name] > 0 else ("−", "+")
            return (
                f"{there} spring that the model does not have: it grows stiffer towards {stiff} "
                f"and softer towards {soft} (a force of {size} times the motion squared)."
            )
        what, way = ("hardening", "stiffer") if values[name] > 0 else ("softening", "softer")
        return (
            f"{there} {what} spring that the model does not have: "
            f"it grows {way} the further it is moved (a force of {size} times the motion cubed)."
        )
