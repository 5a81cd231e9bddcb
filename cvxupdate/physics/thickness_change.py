"""``thickness_change``: a factor on a plate's thickness or a rectangle's height: bending stiffness
with its cube, mass with itself (thesis 8.4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import factors, percent
from cvxupdate.physics.members import member_sets

LIMITS = (-0.8, 3.0)


@final
class ThicknessChange(EffectType):
    """A factor on thickness or height."""

    name = "thickness_change"
    noun = "a change of thickness"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """On every set of plates, and of beams of rectangular section."""
        model = context.model
        return [
            e
            for of in ("thickness", "height")
            for e in factors(self, model, of, member_sets(model, of), LIMITS, cubic=True)
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The change in percent."""
        return percent(effect, values, "thicker", "thinner")
