"""A mass that is known, put on a fitted explanation."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.types import Evidence
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import plant


def with_lump(evidence: Evidence, model: Model, node: int) -> Model:
    """The model with a lump at a node, whose mass is its last parameter, zero.

    Raises
    ------
    CvxupdateError
        Where the node cannot carry one.
    """
    lumps = evidence.candidates(model, ("added_mass",))
    lump = next((e for e in lumps if e.place.nodes == (node,)), None)
    if lump is None:
        raise CvxupdateError(f"node {node} carries no mass.")
    return plant(lump, model, np.zeros(1), evidence.delay_unit).model
