"""``structural_damping``: hysteretic loss in a group, D = η K (3.45); tell-tale: damping follows
the share of strain energy in the group."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import RATIOS, RESPONSES, Effect, EffectType
from cvxupdate.physics.factors import on_sets
from cvxupdate.physics.growth import Rates, Wanted, limited
from cvxupdate.physics.members import member_sets
from cvxupdate.physics.place import at
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import number

LOSS = 0.02  # loss factor that is one unit
LIMITS = (0.0, 50.0)


@final
class StructuralDamping(EffectType):
    """A loss factor."""

    name = "structural_damping"
    noun = "loss in the material"
    damping = True
    told_by = frozenset({RESPONSES, RATIOS})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """On every group; that of everything alike is what every mode's damping may be anyway."""
        sets = member_sets(context.model, "eta")
        whole = max((len(ids) for ids, _ in sets), default=0)
        some = [(i, g) for i, g in sets if g and not (len(g) > 1 and len(i) == whole)]

        def wanted(k: int, ids: tuple[int, ...]) -> list[Wanted]:
            return [limited(f"{self.name}@{k}", "eta", ids, LIMITS, LOSS)]

        rates = Rates.of(context.model, "eta", LOSS)
        figures = [physical("eta", "")]
        return on_sets(
            self, context.model, some, wanted, figures, limits=LIMITS, sign=1, rates=rates
        )

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The loss factor."""
        return (
            f"The material {at(effect.place)} loses energy (loss factor {number(values['eta'], 2)})"
            " beyond the rest of the structure."
        )
