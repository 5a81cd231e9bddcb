"""``joint_flexibility``: the end of a beam turns on a spring where the model joins it rigidly
(Friswell and Mottershead 1995, 3.4)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.base import Candidate, Context, Place, Wanted, append_parameters, small_block
from cvxupdate.physics.grounding_spring import RIGID, SOFTEST, Compliance


def candidates(context: Context) -> list[Candidate]:
    """One at every beam end that meets another element: the rotations of that end get DOFs of their
    own, joined to the node by one compliance about every active axis. The screening column is −k_i
    k_iᵀ of the element, exact for a rigid joint. At a node of two beams in line, one end stands for
    both."""
    model = context.model
    meeting: dict[int, int] = {}
    for block in model.blocks:
        if block.kind.name in ("beam2d", "beam3d"):
            half = block.dofs.shape[1] // 2
            for row in block.dofs:
                for end in (row[:half], row[half:]):
                    turning = [
                        int(d)
                        for d, k in zip(end, block.direction[0, :half], strict=True)
                        if k >= 3 and d >= 0
                    ]
                    if turning:
                        meeting[turning[0]] = meeting.get(turning[0], 0) + 1
    out, done = [], set()
    for number, block in enumerate(model.blocks):
        if block.kind.name not in ("beam2d", "beam3d"):
            continue
        half = block.dofs.shape[1] // 2
        matrices = block.combine(block.scalars(block.properties)).get("K")
        if matrices is None:
            continue
        for e in range(len(block.ids)):
            for end in (0, 1):
                columns = [
                    end * half + i
                    for i in range(half)
                    if block.direction[0, i] >= 3 and block.dofs[e, end * half + i] >= 0
                ]
                if not columns:
                    continue
                first = int(block.dofs[e, columns[0]])
                if meeting.get(first, 0) < 2 or (meeting[first] == 2 and first in done):
                    continue
                done.add(first)
                out.append(_joint(context, number, e, columns, np.asarray(matrices[e])))
    return out


def _joint(context: Context, number: int, e: int, columns: list[int], k: np.ndarray) -> Candidate:
    model = context.model
    block = model.blocks[number]
    rows = block.dofs[e, columns]
    node = int(model.node_ids[model.dof_node[rows[0]]])
    element = int(block.ids[e])
    unit = 1.0 / float(np.mean(k[columns, columns]))
    free_columns = np.flatnonzero(block.dofs[e] >= 0)
    bend = np.sum([np.outer(k[free_columns, c], k[c, free_columns]) for c in columns], axis=0)
    tangent = DerivativeBlock(
        block.dofs[e][free_columns][None], (-bend * unit)[None], None, None, None
    )
    dof = KINDS[int(block.direction[0, columns[0]])]
    return Candidate(
        "joint_flexibility",
        Place(nodes=(node,), elements=(element,), dof=dof),
        partial(_grown, model, number, e, columns, node, unit),
        1,
        np.zeros(1),
        ((tangent,),),
        sign=1,
        report=(("k", 0, "inverse"),),
        offset=unit / RIGID,
        limits=(0.0, SOFTEST),
    )


def _grown(model: Model, number: int, e: int, columns: list[int], node: int, unit: float) -> Model:
    block = model.blocks[number]
    rows, kinds = block.dofs[e, columns], block.direction[0, columns]
    element = int(block.ids[e])
    fresh = np.arange(model.size, model.size + len(columns))
    dofs = block.dofs.copy()
    dofs[e, columns] = fresh
    grown: Model = replace(
        model,
        labels=(*model.labels, *(f"n{node}@e{element}.{KINDS[c]}" for c in kinds)),
        dof_node=np.append(model.dof_node, np.full(len(columns), model.dof_node[rows[0]])),
        dof_kind=np.append(model.dof_kind, kinds),
        blocks=tuple(
            replace(b, dofs=dofs) if i == number else b for i, b in enumerate(model.blocks)
        ),
    )
    ids: list[int] = []
    for free, kind, row in zip(fresh, kinds, rows, strict=True):
        spring = small_block(
            grown,
            Compliance(2, KINDS[int(kind)]),
            np.array([[row, free]]),
            [int(kind)] * 2,
            "K",
            np.array([[1.0, -1.0], [-1.0, 1.0]]),
            {"a": 0.0, "a0": unit / RIGID},
        )
        ids.append(int(spring.ids[0]))
        grown = replace(grown, blocks=(*grown.blocks, spring))
    return append_parameters(
        grown,
        [Wanted(f"joint@e{element}n{node}", "a", tuple(ids), lower=0.0, upper=SOFTEST, scale=unit)],
    )
