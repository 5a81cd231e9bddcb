"""Which DOFs a model has, and in which order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.fe.batches import Batch, GivenMatrix, Place
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.labels import KINDS
from cvxupdate.spec import model as sm


def number_dofs(
    text: sm.Model,
    position: dict[int, int],
    xyz: Real,
    active: tuple[str, ...],
    batches: Sequence[Batch],
    given: Sequence[GivenMatrix],
) -> tuple[Place, Index, Real, list[tuple[int, int]]]:
    """Free DOFs in the order of nodes and kinds: those that an element touches and no support
    holds."""
    node_ids = [n.id for n in text.nodes]
    extra = sorted({node for g in given for node, _ in g.matrix.labels} - set(position))
    for node in extra:  # DOFs of given matrices may have no drawn node
        position[node] = len(node_ids)
        node_ids.append(node)
    xyz = np.vstack([xyz, np.zeros((len(extra), 3))])
    touched: set[tuple[int, int]] = {(position[n], k) for g in given for n, k in g.matrix.labels}
    for batch in batches:
        touched |= _brought(batch, position, active)
    held = {
        (position[n], KINDS.index(d))
        for s in text.supports
        for n in (node_ids if s.nodes == "all" else s.nodes)
        for d in s.dofs
    }
    first = first_of_ties(text, position)
    labels = sorted({first.get(t, t) for t in touched} - {first.get(h, h) for h in held})
    place = {label: i for i, label in enumerate(labels)}
    place |= {tied: place[to] for tied, to in first.items() if to in place}
    return place, np.array(node_ids, dtype=np.int64), xyz, labels


def first_of_ties(
    text: sm.Model, position: dict[int, int]
) -> dict[tuple[int, int], tuple[int, int]]:
    """DOF of a tied node, or of one on a base, → the DOF it is the same as."""
    first: dict[tuple[int, int], tuple[int, int]] = {}
    shared = [(t.nodes, t.dofs) for t in text.ties] + [(b.nodes, (b.dof,)) for b in text.bases]
    for nodes, dofs in shared:
        for kind in (KINDS.index(d) for d in dofs):
            ends = [(position[n], kind) for n in nodes]
            ends = [first.get(e, e) for e in ends]
            for e in ends[1:]:
                if e != ends[0]:
                    first |= {**{a: ends[0] for a, b in first.items() if b == e}, e: ends[0]}
    return first


def _brought(
    batch: Batch, position: dict[int, int], active: tuple[str, ...]
) -> set[tuple[int, int]]:
    """(node, kind) of the DOFs that the elements of a batch bring."""
    out: set[tuple[int, int]] = set()
    brings = batch.kind.brings
    for dof in batch.kind.dofs:
        if dof not in active or (brings is not None and dof not in brings):
            continue
        amounts = [1.0] * len(batch.ids) if brings is None else batch.properties[brings[dof]]
        out |= {
            (position[n], KINDS.index(dof))
            for nodes, amount in zip(batch.nodes, amounts, strict=True)
            if amount != 0.0
            for n in nodes
        }
    return out
