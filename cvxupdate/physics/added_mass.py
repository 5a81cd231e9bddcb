"""``added_mass``: a lump at a node, in every active translation (negative: taken off). Friswell and
Mottershead (1995), 3.2."""

from __future__ import annotations

from functools import partial

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Mass, Term
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.base import (
    TRANSLATIONS,
    Candidate,
    Context,
    Place,
    Wanted,
    at_once,
    dof_rows,
    new_ids,
    with_block,
)

LIMITS = (-20.0, 1000.0)  # hundredths of the structure's mass


def candidates(context: Context) -> list[Candidate]:
    """One at every node that can translate; the unit is a hundredth of the structure's mass.
    Tell-tale: all modes fall that move the node."""
    model = context.model
    nodes: dict[int, list[int]] = {}
    for row, node, _ in dof_rows(model, TRANSLATIONS):
        nodes.setdefault(node, []).append(row)
    unit = 0.01 * max(model.total_mass(), 1e-12)
    out = []
    for node, rows in nodes.items():
        dof = KINDS[int(model.dof_kind[rows[0]])] if len(rows) == 1 else None
        out.append(
            Candidate(
                "added_mass",
                Place(nodes=(node,), dof=dof),
                partial(_grown, model, node, rows, unit),
                1,
                np.zeros(1),
                at_once(rows, "M", unit * np.eye(len(rows))),
                report=(("m", 0, "value"),),
                limits=LIMITS,
            )
        )
    return out


def _grown(model: Model, node: int, rows: list[int], unit: float) -> Model:
    properties = {
        **{k: np.array([v]) for k, v in COMMON.items()},
        **{k: np.zeros(1) for k in ("m", "Ixx", "Iyy", "Izz")},
    }
    ids = new_ids(model, 1)
    block = Block(
        Mass(),
        ids,
        ("",),
        np.array([rows]),
        np.array([[int(model.dof_kind[r]) for r in rows]]),
        (Term("M", "m", np.eye(len(rows))[None]),),
        np.zeros(1, dtype=np.int64),
        properties,
    )
    return with_block(
        model,
        block,
        [
            Wanted(
                f"added_mass@n{node}",
                "m",
                (int(ids[0]),),
                lower=LIMITS[0],
                upper=LIMITS[1],
                scale=unit,
            )
        ],
    )
