"""``orthotropy``: direction-dependent rigidities of a plate group (8.4): Dx, Dy, D1, Dxy as factors
on the isotropic ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import on_sets
from cvxupdate.physics.growth import Wanted, limited
from cvxupdate.physics.members import member_sets
from cvxupdate.physics.place import at
from cvxupdate.physics.quantity import factor
from cvxupdate.physics.units import number

LIMITS = (-0.8, 3.0)
ALIKE = 2.0  # deviations from a common factor within which four rigidities are those of one
RIGIDITIES = ("Dx", "Dy", "D1", "Dxy")


@final
class Orthotropy(EffectType):
    """Four rigidities."""

    name = "orthotropy"
    noun = "direction-dependent stiffness"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """In every group of plates."""
        sets = [(i, g) for i, g in member_sets(context.model, "Dx") if g]

        def wanted(k: int, ids: tuple[int, ...]) -> list[Wanted]:
            return [limited(f"{self.name}.{n}@{k}", n, ids, LIMITS) for n in RIGIDITIES]

        figures = [factor(n, k) for k, n in enumerate(RIGIDITIES)]
        return on_sets(self, context.model, sets, wanted, figures, limits=LIMITS)

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        """Whether all rigidities may have one factor: a change of stiffness, or of thickness."""
        v, s = (np.array([x[n] for n in RIGIDITIES]) for x in (values, deviations))
        weights = 1.0 / np.maximum(s, 1e-12) ** 2
        common = float(weights @ v / weights.sum())
        return bool(np.all(np.abs(v - common) <= ALIKE * s))

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Every rigidity against the modelled one."""
        stiff = ", ".join(f"{n} {number(values[n])}" for n in RIGIDITIES if n in values)
        return (
            f"The plate {at(effect.place)} is not equally stiff in all directions (times the "
            f"modelled: {stiff})."
        )
