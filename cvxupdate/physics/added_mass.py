"""``added_mass``: a lump at a node, in every active translation (negative: taken off). Friswell and Mottershead (1995), 3.2."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Mass, Term
from cvxupdate.fe.model import KINDS
from cvxupdate.physics.base import TRANSLATIONS, Candidate, Context, Place, Wanted, dof_rows, new_ids, tangents, with_block


def candidates(context: Context) -> list[Candidate]:
    """One at every node that can translate; the unit is a hundredth of the structure's mass. Tell-tale: all modes fall that move the node."""
    model = context.model
    nodes: dict[int, list[int]] = {}
    for row, node, _ in dof_rows(model, TRANSLATIONS):
        nodes.setdefault(node, []).append(row)
    unit = 0.01 * max(model.total_mass(), 1e-12)
    out = []
    for node, rows in nodes.items():
        pattern = np.eye(len(rows))
        properties = {**{k: np.array([v]) for k, v in COMMON.items()}, **{k: np.zeros(1) for k in ("m", "Ixx", "Iyy", "Izz")}}
        ids = new_ids(model, 1)
        block = Block(Mass(), ids, ("",), np.array([rows]), np.array([[int(model.dof_kind[r]) for r in rows]]), (Term("M", "m", pattern[None]),),
                      np.zeros(1, dtype=np.int64), properties)
        grown = with_block(model, block, [Wanted(f"added_mass@n{node}", "m", (int(ids[0]),), lower=-20.0, upper=1000.0, scale=unit)])
        dof = KINDS[int(model.dof_kind[rows[0]])] if len(rows) == 1 else None
        out.append(Candidate("added_mass", Place(nodes=(node,), dof=dof), grown, 1, np.zeros(1), tangents(grown, 1), report=(("m", 0, "value"),)))
    return out
