"""``grounding_spring`` at a spring to ground that the reference state has: it gives more today."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import final

from cvxupdate.fe.model import Model
from cvxupdate.physics.compliance import SOFTEST
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.place import Place, at
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.released import tangent_of
from cvxupdate.physics.sprung import Sprung, softened, sprung_of
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, SOFTEST)


@dataclass(frozen=True, eq=False)
class Looser(ModelChange):
    """Of a spring that held with ``before`` (N/m or N·m/rad)."""

    before: float = 0.0

    @property
    def detail(self) -> tuple[str, ...]:
        """What tells it from a spring beside it."""
        return ("looser",)


@final
class LooserSupport(EffectType):
    """A support on a spring that has become softer."""

    name = "grounding_spring"
    noun = "a support that gives more"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every spring to ground that the model was given."""
        out = []
        for spring in sprung_of(context):
            unit, place = 1.0 / spring.k, Place(nodes=(spring.node,), dof=spring.kind)
            along = spring.along(unit)
            change = Looser(
                partial(_softer, context.model, spring, unit),
                ((tangent_of(along),),),
                (spring.id,),
                series=True,
                along=along,
                before=spring.k,
            )
            figures = (stiffness("k", stiffness_unit(place), unit),)
            out.append(Effect(self, place, change, figures, 1, LIMITS))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """What it holds with, and did."""
        unit, before = stiffness_unit(effect.place), getattr(effect.action, "before", 0.0)
        return (
            f"The support {at(effect.place)} gives more than it did: it holds with "
            f"{quantity(values['k'], unit)}, where {quantity(before, unit)} held before."
        )


def _softer(model: Model, spring: Sprung, unit: float) -> Model:
    name = f"looser@n{spring.node}.{spring.kind}"
    grown = softened(model, [spring], [1.0])
    return append_parameters(grown, [limited(name, "a", [spring.id], LIMITS, unit)])
