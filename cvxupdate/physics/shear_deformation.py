"""``shear_deformation``: Timoshenko shear where the model is Euler–Bernoulli, Reissner's where it
is Kirchhoff's; tell-tale: high modes fall, the more the higher. Φ = 12 E I / (κ G A L²)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import on_sets
from cvxupdate.physics.growth import Wanted, limited
from cvxupdate.physics.members import member_sets
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import shear_coefficient
from cvxupdate.physics.units import number

LIMITS = (0.0, 3.0)  # of the flexibility in shear that the section's κ gives


@final
class ShearDeformation(EffectType):
    """Beams and shells that deform in shear."""

    name = "shear_deformation"
    noun = "deformation in shear"
    theory = True

    def candidates(self, context: SearchContext) -> list[Effect]:
        """In every group of beams or shells; in all of them where none is in a group."""
        known = member_sets(context.model, "shear")
        most = max((len(i) for i, _ in known), default=0)
        sets = [(i, g) for i, g in known if g or len(i) == most > 1]

        def wanted(k: int, ids: tuple[int, ...]) -> list[Wanted]:
            return [limited(f"shear@{k}", "shear", ids, LIMITS, 1.0)]

        figures = [shear_coefficient("kappa")]
        return on_sets(self, context.model, sets, wanted, figures, limits=LIMITS, sign=1)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The shear coefficient."""
        return (
            f"{capital(at(effect.place))} the structure is too stocky for the model: it also "
            f"deforms in shear (shear coefficient {number(values['kappa'], 2)})."
        )
