"""``grounding_spring`` at a support: it is softer than rigid, k from infinity downwards."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.columns import stiffness_columns
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import RIGID, SOFTEST, Compliance, write
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.given import Points
from cvxupdate.physics.growth import small_block, with_block
from cvxupdate.physics.place import Place, at
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, SOFTEST)


@final
class SoftSupport(EffectType):
    """A support that gives way."""

    name = "grounding_spring"
    noun = "a support that gives way"
    rig = True
    writers = (("compliance", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Every held DOF set free on a spring; the tangent is −k_i k_iᵀ / k_ii per unit, exact at
        infinite stiffness."""
        out = []
        for node, kind in context.supports:
            model = context.release(node, kind)
            label = f"n{node}.{kind}"
            if label not in model.place:
                continue
            row = model.place[label]
            column = stiffness_columns(model, np.array([row]))[:, 0]
            own = float(column[row])
            if own <= 0.0:
                continue
            unit, place = 1.0 / own, Place(nodes=(node,), dof=kind)
            change = ModelChange(
                partial(_softened, model, row, label, kind, unit),
                ((_tangent(context, model, column, row, unit),),),
                series=True,
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


def _softened(model: Model, row: int, label: str, kind: str, unit: float) -> Model:
    block = small_block(
        model,
        Compliance(1, kind),
        np.array([[row]]),
        [KINDS.index(kind)],
        "K",
        np.ones((1, 1)),
        {"a": 0.0, "a0": unit / RIGID},
    )
    return with_block(model, block, f"soft_support@{label}", "a", LIMITS, unit)


def _tangent(
    context: SearchContext, model: Model, column: Real, row: int, unit: float
) -> DerivativeBlock:
    base = context.model.place
    used = [i for i in np.flatnonzero(column) if i != row and model.labels[i] in base]
    k = column[used]
    dofs = np.array([[base[model.labels[i]] for i in used]], dtype=np.int64)
    return DerivativeBlock(dofs, (-np.outer(k, k) * unit)[None], None, None, None)
