"""Edges of sheets that springs of the file hold all along (``edge`` of a spring): between nodes
they act as well, where supports set free would (`cvxupdate.fe.analysis.rims`)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.fe.analysis.reduced import Inner
from cvxupdate.fe.analysis.rims import Support, ends_of, spread
from cvxupdate.fe.block import Block
from cvxupdate.fe.edge_springs import all_along
from cvxupdate.fe.elements.spring import Spring
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model


def with_held_edges(file: Model, fine: Model, inner: Sequence[Inner]) -> Model:
    """The model on finer parts with such springs spread along the edges between them and the
    supports of their kind; ``inner``: what it has beyond the model of the ``file``. A spring keeps
    its stiffness: of equal ones along an edge each has the length that is its own."""
    number = [k for k, b in enumerate(file.blocks) if isinstance(b.kind, Spring) and b.kind.edge]
    at: dict[Support, list[tuple[int, int]]] = {}  # block, row
    for k in number:
        for e, row in enumerate(file.blocks[k].dofs[:, 0].tolist()):
            if row >= 0:
                kind = KINDS[int(file.dof_kind[row])]
                at.setdefault((int(file.node_ids[file.dof_node[row]]), kind), []).append((k, e))
    own = [f"n{node}.{kind}" for node, kind in at]
    labels = [*own, *(x.label for x in inner if _between(file, ends_of(x.label), at))]
    told = spread(fine, labels, list(at)) if len(labels) > len(own) else None
    if told is None:
        return fine
    rows = np.array([fine.place[label] for label in labels])
    blocks = list(fine.blocks)
    for k in number:
        mine = [(i, e) for i, some in enumerate(at.values()) for block, e in some if block == k]
        blocks[k] = _spread(blocks[k], mine, rows, told[0] / told[1][:, None, None])
    return replace(fine, blocks=tuple(blocks))


def _between(file: Model, ends: tuple[int, ...], at: Collection[Support]) -> bool:
    """Whether springs hold what is between the ends in any direction."""
    return any(
        all_along(((n, kind) in at for n in ends), (f"n{n}.{kind}" not in file.place for n in ends))
        for kind in {k for _, k in at}
    )


def _spread(
    block: Block, mine: Sequence[tuple[int, int]], rows: np.ndarray, springs: np.ndarray
) -> Block:
    """``mine``: (place among ``springs`` (h, r, r) and ``rows`` (r,), row of the block); its own
    DOF first."""
    r = len(rows)
    dofs, values = np.full((len(block.ids), r), -1), np.zeros((len(block.ids), r, r))
    for i, e in mine:
        order = np.array([i, *np.delete(np.arange(r), i)])
        dofs[e], values[e] = rows[order], springs[i][np.ix_(order, order)]
    (term,) = block.terms
    return replace(
        block,
        dofs=dofs,
        direction=np.full((1, r), block.direction[0, 0]),
        terms=(replace(term, values=values),),
        geometry=np.arange(len(block.ids)),
        own=1,
    )
