"""``viscous_damper``: a dashpot at a node or between nodes; tell-tale: complex modes, damping of
the modes that move it."""

from __future__ import annotations

from functools import partial

import numpy as np

from cvxupdate.fe.elements import Dashpot
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.base import (
    TRANSLATIONS,
    Candidate,
    Context,
    Place,
    Wanted,
    at_once,
    dof_rows,
    small_block,
    with_block,
)

STRONGEST = 1e5  # units


def candidates(context: Context) -> list[Candidate]:
    """To ground at every free translation, and across every spring (two-node elements that act
    along one DOF)."""
    model = context.model
    out = []
    for row, node, kind in dof_rows(model, TRANSLATIONS):
        out.append(_one(context, (row,), (node,), kind))
    for a, b, kind in neighbours(model):
        nodes = (int(model.node_ids[model.dof_node[a]]), int(model.node_ids[model.dof_node[b]]))
        out.append(_one(context, (a, b), nodes, kind))
    return out


def _one(context: Context, rows: tuple[int, ...], nodes: tuple[int, ...], kind: str) -> Candidate:
    model = context.model
    k, m = context.local(rows[0])
    unit = (
        0.02 * max(m * 2 * np.pi * context.bottom, 0.02 * np.sqrt(max(k * m, 0.0)))
        if m > 0
        else 1.0
    )
    pattern = np.ones((1, 1)) if len(rows) == 1 else np.array([[1.0, -1.0], [-1.0, 1.0]])
    return Candidate(
        "viscous_damper",
        Place(nodes=nodes, dof=kind),
        partial(_grown, model, rows, nodes, kind, pattern, unit),
        1,
        np.zeros(1),
        at_once(rows, "C", unit * pattern),
        sign=1,
        report=(("c", 0, "value"),),
        limits=(0.0, STRONGEST),
    )


def _grown(
    model: Model,
    rows: tuple[int, ...],
    nodes: tuple[int, ...],
    kind: str,
    pattern: np.ndarray,
    unit: float,
) -> Model:
    block = small_block(
        model,
        Dashpot(kind, len(rows)),
        np.array([rows]),
        [KINDS.index(kind)] * len(rows),
        "C",
        pattern,
        {"c": 0.0},
    )
    wanted = Wanted(
        "viscous_damper@" + "-".join(str(n) for n in nodes) + kind,
        "c",
        (int(block.ids[0]),),
        lower=0.0,
        upper=STRONGEST,
        scale=unit,
    )
    return with_block(model, block, [wanted])


def neighbours(model: Model) -> list[tuple[int, int, str]]:
    """(row, row, kind) of free DOFs joined by a spring element."""
    out = []
    for block in model.blocks:
        if block.kind.name == "spring" and block.dofs.shape[1] == 2:
            out += [
                (int(a), int(b), KINDS[int(block.direction[0, 0])])
                for a, b in block.dofs.tolist()
                if a >= 0 and b >= 0
            ]
    return sorted(set(out))
