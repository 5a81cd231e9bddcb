"""``grounding_spring`` at a support: it is softer than rigid, k from infinity downwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import final

from cvxupdate.fe.model import Model
from cvxupdate.physics.compliance import EDGE, RIGID, SOFTEST, write, write_edge
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.given import Points
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.place import Place, at
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.released import Held, Released, tangent_of
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, SOFTEST)


@final
class SoftSupport(EffectType):
    """A support that gives way."""

    name = "grounding_spring"
    noun = "a support that gives way"
    rig = True
    writers = (("compliance", write), (EDGE, write_edge))

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Every held DOF set free on a spring, on the edge of a sheet with the length that is its
        own."""
        return self._of(context, context.supports)

    def at(self, place: Place, context: SearchContext) -> list[Effect]:
        """Only what holds there is set free."""
        held = [(n, kind) for n, kind in context.supports if (n,) == place.nodes]
        return self._of(context, [(n, kind) for n, kind in held if kind == place.dof])

    def _of(self, context: SearchContext, held: Sequence[Held]) -> list[Effect]:
        out = []
        for node, kind in held:
            free = Released.of(context, [(node, kind)])
            if not free.held or free.within[0, 0] <= 0.0:
                continue
            unit, place = free.unit, Place(nodes=(node,), dof=kind)
            along = free.along(unit)
            change = ModelChange(
                partial(_softened, free, unit), ((tangent_of(along),),), series=True, along=along
            )
            figures = (stiffness("k", stiffness_unit(place), unit / RIGID),)
            out.append(Effect(self, place, change, figures, 1, LIMITS))
        for points in Points.of(context):
            out += [self._at(points.only(k)) for k in range(len(points.ids))]
        return out

    def _at(self, point: Points) -> Effect:
        """Where a sheet gives way itself."""
        place = Place(nodes=point.nodes, dof=point.dof)
        name = f"soft_support@n{point.nodes[0]}.{point.dof}"
        softer = partial(point.softer, name, LIMITS)
        change = ModelChange(softer, ((point.tangent,),), series=True)
        figures = (stiffness("k", stiffness_unit(place), point.rigid),)
        return Effect(self, place, change, figures, 1, LIMITS)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """What it holds with."""
        k = quantity(values["k"], stiffness_unit(effect.place))
        return (
            f"The support {at(effect.place)} gives way: it holds with {k}, while the model holds "
            "it rigidly."
        )


def _softened(free: Released, unit: float) -> Model:
    model, ((node, kind),) = free.sprung(unit), free.held
    name, ids = f"soft_support@n{node}.{kind}", model.blocks[-1].ids.tolist()
    return append_parameters(model, [limited(name, "a", ids, LIMITS, unit)])
