"""What is known, put on a fitted explanation: a mass, or a spring to ground."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.types import Evidence
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model


def with_lump(evidence: Evidence, model: Model, node: int) -> Model:
    """The model with a lump at a node, whose mass is its last parameter, zero.

    Raises
    ------
    ModelError
        Where the node cannot carry one.
    """
    return with_known(evidence, model, "added_mass", node)


def with_known(
    evidence: Evidence, model: Model, physics: str, node: int, dof: str | None = None
) -> Model:
    """The model with an effect at a node (in a direction), whose size is its last parameter, zero.

    Raises
    ------
    ModelError
        Where it cannot stand there.
    """
    placed = evidence.candidates(model, (physics,))
    found = next(
        (e for e in placed if e.place.nodes == (node,) and dof in (None, e.place.dof)), None
    )
    if found is None:
        raise ModelError(f"node {node} carries no {physics}.")
    return found.action.plant(found, model, np.zeros(1), evidence.delay_unit).model
