"""An effect that the package does not have, in one class: springs of one stiffness under every node
(Winkler's foundation)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.elements import Spring
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import dof_rows, small_block, with_block
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

LIMITS = (0.0, 1e3)


@final
class Foundation(EffectType):
    """Springs of one stiffness under every node."""

    name = "elastic_foundation"
    noun = "a soft foundation"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One for each direction; the unit is a hundredth of the mean stiffness of the DOFs."""
        out = []
        for kind in ("x", "y", "z"):
            rows = [row for row, _, _ in dof_rows(context.model, (kind,))]
            if rows:
                unit = 0.01 * float(np.mean([context.local(r)[0] for r in rows]))
                K = np.full((len(rows), 1, 1), unit)
                blocks = (DerivativeBlock(np.array(rows)[:, None], K, None, None, None),)
                grow = partial(_grown, context.model, rows, kind, unit)
                change = ModelChange(grow, (blocks,), additive=True)
                figures = (physical("k", "N/m"),)
                out.append(Effect(self, Place(dof=kind), change, figures, 1, LIMITS))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The stiffness under a node."""
        return f"Every node stands on a spring of {quantity(values['k'], 'N/m')}."


def _grown(model: Model, rows: list[int], kind: str, unit: float) -> Model:
    dofs, along = np.array(rows)[:, None], [KINDS.index(kind)]
    block = small_block(model, Spring(kind, 1), dofs, along, "K", np.ones((1, 1)), {"k": 0.0})
    return with_block(model, block, "foundation", "k", LIMITS, unit)
