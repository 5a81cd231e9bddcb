"""Where two parts of a structure may touch or rub: nodes that face each other."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cvxupdate.fe.block import Block
from cvxupdate.fe.model import Model
from cvxupdate.physics.members import straight
from cvxupdate.registry import ELEMENTS

SMALL = 1e-6  # of a distance, between nodes of one grid
NEAREST = 12  # neighbours among which the other part is sought: its own are a few of them


def facing(model: Model) -> list[tuple[int, int]]:
    """Pairs (node, node), as indices of `Model.node_ids`, of two parts that do not meet: each node
    with the nearest of another part that is no further away than its own part's next node. Parts
    that nothing but ground and springs joins face each other at any distance.

    A part is a straight member, or elements with three nodes and more as far as they hang together.
    """
    parts = _parts(model)
    if len(parts) < 2:
        return []
    inside = np.zeros((len(parts), len(model.node_ids)), dtype=bool)
    for k, nodes in enumerate(parts):
        inside[k, nodes] = True
    meet = (inside.astype(int) @ inside.T) > 0
    body = connected_components(coo_array(meet), directed=False)[1]
    bodies = np.full(len(model.node_ids), -1)
    for k, nodes in enumerate(parts):
        bodies[nodes] = body[k]
    reach = _spacing(model)
    found = _near(model, inside, meet, reach) | _between(model, bodies)
    return sorted(found)


def _near(
    model: Model, inside: np.ndarray, meet: np.ndarray, reach: np.ndarray
) -> set[tuple[int, int]]:
    """Of each node the nearest within ``reach`` whose parts meet none of its own."""
    used = np.flatnonzero(inside.any(axis=0))
    away, which = cKDTree(model.xyz[used]).query(model.xyz[used], min(NEAREST, len(used)))
    found: set[tuple[int, int]] = set()
    for a, distances, others in zip(used.tolist(), away, which, strict=True):
        mine = meet[inside[:, a]].any(axis=0)
        for distance, b in zip(distances, used[others].tolist(), strict=True):
            if distance <= (1.0 + SMALL) * reach[a] and not mine[inside[:, b]].any():
                found.add((min(a, b), max(a, b)))
                break
    return found


def _between(model: Model, bodies: np.ndarray) -> set[tuple[int, int]]:
    """Of each node the nearest of every other body."""
    found: set[tuple[int, int]] = set()
    each = [np.flatnonzero(bodies == k) for k in range(int(bodies.max()) + 1)]
    for one in each:
        for other in each:
            if one is not other:
                _, near = cKDTree(model.xyz[other]).query(model.xyz[one])
                pairs = zip(one.tolist(), other[near].tolist(), strict=True)
                found |= {(min(p), max(p)) for p in pairs}
    return found


def _parts(model: Model) -> list[np.ndarray]:
    """Indices of the nodes of each part, held ones left out."""
    nodes = {i: n for block in model.blocks if _extended(block) for i, n in _nodes(model, block)}
    members = [m for m in straight(model, "stiffness") if set(m) <= nodes.keys()]
    grouped = {i for member in members for i in member}
    members += [(i,) for i, n in nodes.items() if len(n) <= 2 and i not in grouped]
    found = [np.unique(np.concatenate([nodes[i] for i in m if i in nodes])) for m in members]
    wide = [n for n in nodes.values() if len(n) > 2]
    if wide:
        count = len(model.node_ids)
        ends = [(n[0], b) for n in wide for b in n[1:]]
        rows, columns = np.array(ends).T
        graph = coo_array((np.ones(len(ends)), (rows, columns)), shape=(count, count))
        label = connected_components(graph, directed=False)[1]
        touched = np.unique(np.concatenate(wide))
        found += [touched[label[touched] == k] for k in np.unique(label[touched])]
    return [n for n in found if len(n)]


def _extended(block: Block) -> bool:
    """Whether its elements are bars, sheets or solids."""
    return any(t.name == block.kind.name and t.text.outline for t in ELEMENTS.members())


def _nodes(model: Model, block: Block) -> list[tuple[int, np.ndarray]]:
    """(element, indices of its free nodes)."""
    return [
        (i, np.unique(model.dof_node[row[row >= 0]]))
        for i, row in zip(block.ids.tolist(), block.nodal, strict=True)
    ]


def _spacing(model: Model) -> np.ndarray:
    """(nodes,) how far the next node of the same part is: of its elements the longest edge that
    ends there; 0 where it has none."""
    out = np.zeros(len(model.node_ids))
    for block in model.blocks:
        if not _extended(block):
            continue
        for _, nodes in _nodes(model, block):
            xyz = model.xyz[nodes]
            away = np.linalg.norm(xyz[:, None] - xyz[None], axis=2)
            np.fill_diagonal(away, np.inf)
            next_ = away.min(axis=1) if len(nodes) > 1 else np.zeros(len(nodes))
            out[nodes] = np.maximum(out[nodes], next_)
    return out
