"""``hysteresis``: a spring in series with a slider (Jenkin 1922): sticks, slips, and remembers.
Tell-tale: softer and more damped as the level grows, then less damped again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MOTION, Effect, EffectType
from cvxupdate.physics.internal_force import ABOVE, NonlinearForce, places, write
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

KNEES = (1.0, 2.0)  # sharpness of Bouc and Wen's law: soft, and as most joints are fitted
# of Iwan's: slip distances alike up to the largest, and more of the short ones, as bolted joints
EXPONENTS = (0.0, -0.5)


@final
class Hysteresis(EffectType):
    """A joint that sticks and slips."""

    name = "hysteresis"
    noun = "a joint that sticks and slips"
    told_by = frozenset({MOTION})
    writers = (("jenkins", write), ("bouc_wen", write))

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
        slips = f"slips at {force}"
        if isinstance(effect.action, NonlinearForce) and effect.action.fixed:
            fixed = dict(effect.action.fixed)
            law = f"Bouc and Wen's law, n = {fixed['n']:g}" if "n" in fixed else ""
            law = law or f"Iwan's law, exponent {fixed['chi']:g}"
            slips = f"gives way gradually up to {force} ({law})"
        return (
            f"{capital(at(effect.place))} a joint sticks like a spring of {k} and {slips}, so that "
            "its force depends on where it came from; the model does not have it."
        )


def other_forms(effect: Effect) -> list[Effect]:
    """The same joint with other laws: where it slips at once, those by which it gives way
    gradually (Wen 1976; knees of n = 1 and 2, unloading with its first stiffness; Iwan 1966,
    sliders side by side)."""
    action = effect.action
    if not isinstance(action, NonlinearForce) or action.law != "jenkins":
        return []
    forms = [(("n", n), ("gamma", 0.5)) for n in KNEES]
    bent = [replace(effect, action=replace(action, law="bouc_wen", fixed=f)) for f in forms]
    side = [replace(action, law="iwan", fixed=(("chi", x),)) for x in EXPONENTS]
    return [*bent, *(replace(effect, action=a) for a in side)]
