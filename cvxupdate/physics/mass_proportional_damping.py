"""``mass_proportional_damping``: C = α M over the whole structure: every mode decays at the rate
α / 2 (air, suspension, an exponential window)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import RATIOS, RESPONSES, Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited, tangents
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import number

LIMITS = (0.0, 1e3)  # 1/s


@final
class MassProportionalDamping(EffectType):
    """One rate of decay for all modes."""

    name = "mass_proportional_damping"
    noun = "the same decay of all modes"
    damping = True
    told_by = frozenset({RESPONSES, RATIOS})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One, of the whole structure."""
        wanted = limited(self.name, "alpha", (), LIMITS, 1.0)
        grow = partial(append_parameters, context.model, [wanted])
        change = ModelChange(grow, tangents(grow(), 1))
        return [Effect(self, Place(), change, (physical("alpha", "1/s"),), 1, LIMITS)]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The rate of decay of amplitudes."""
        return (
            f"Every mode dies away at the same rate ({number(values['alpha'] / 2, 2)} a second) "
            "beside its own damping: air, suspension, or an exponential window in the measurement."
        )
