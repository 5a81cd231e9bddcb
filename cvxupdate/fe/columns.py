"""A few columns of the stiffness matrix, from the elements that stand there alone."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.fe.terms import Real


def stiffness_columns(model: Model, rows: Index) -> Real:
    """K[:, rows] (N, r) of a model as it stands."""
    rows = np.asarray(rows, dtype=np.int64)
    out = np.zeros((model.size + 1, len(rows)))  # the last row: what is held
    for block in model.blocks:
        met = np.flatnonzero(np.isin(block.dofs, rows).any(axis=1))
        if not len(met):
            continue
        own = block.scalars({k: v[met] for k, v in block.properties.items()})
        K = block.combine([x for x in own if x[0] == "K"], met).get("K")
        if K is None:
            continue
        dofs = block.dofs[met]
        for column, row in enumerate(rows.tolist()):
            e, d = np.nonzero(dofs == row)
            np.add.at(out[:, column], dofs[e], np.real(K[e, :, d]))
    return out[:-1]
