"""``mass_change``: a factor on M of a set of elements (3.22); lumps are ``added_mass``."""

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
class MassChange(EffectType):
    """A factor on M."""

    name = "mass_change"
    noun = "a change of mass"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """On every set of elements that has a density."""
        sets = member_sets(context.model, "rho")
        return factors(self, context.model, "mass", sets, LIMITS)

    def at(self, place: Place, context: SearchContext) -> list[Effect]:
        """Of the elements there."""
        sets = member_sets(context.model, "rho")
        return factors(self, context.model, "mass", sets, LIMITS, there=place)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The change in percent."""
        return percent(effect, values, "heavier", "lighter")
