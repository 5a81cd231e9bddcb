"""``stiffness_change``: a factor on K of a set of elements (3.22)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import factors, percent
from cvxupdate.physics.members import member_sets
from cvxupdate.physics.place import Place

LIMITS = (-0.95, 9.0)


@final
class StiffnessChange(EffectType):
    """A factor on K."""

    name = "stiffness_change"
    noun = "a change of stiffness"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """On every set of elements that has a stiffness."""
        sets = member_sets(context.model, "stiffness")
        return factors(self, context.model, "stiffness", sets, LIMITS)

    def at(self, place: Place, context: SearchContext) -> list[Effect]:
        """Of the elements there."""
        sets = member_sets(context.model, "stiffness")
        return factors(self, context.model, "stiffness", sets, LIMITS, there=place)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The change in percent."""
        return percent(effect, values, "stiffer", "softer")
