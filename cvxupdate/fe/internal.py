"""The nonlinear elements of a model: laws of internal force, and the directions along which they
act."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.forces import Laws
from cvxupdate.forces.laws import join
from cvxupdate.registry import ELEMENTS


@dataclass(frozen=True)
class InternalForces:
    """``laws`` m; ``directions`` B (N, m), x = Bᵀ q, +1 at the second node (or the only one), −1 at
    the first, 0 where a support holds; ``ids`` (m,) numbers and ``kinds`` words of the elements in
    the problem file."""

    laws: Laws
    directions: sp.csc_array
    ids: Index
    kinds: tuple[str, ...]


def is_nonlinear(model: Model) -> bool:
    """Whether the model has nonlinear elements."""
    return any(_law(block) is not None for block in model.blocks)


def moving(model: Model) -> list[int]:
    """Numbers of the parameters that move the figures of a law."""
    own = [_law(block) is not None for block in model.blocks]
    return [j for j, q in enumerate(model.parameters) if any(own[t.block] for t in q.targets)]


def internal_forces(model: Model, p: Real | None = None) -> InternalForces:
    """The nonlinear elements at ``p``; none of a linear model."""
    laws, at, ids, kinds = [], [], [], []
    for block, properties in zip(model.blocks, model.properties(p), strict=True):
        law = _law(block)
        if law is None:
            continue
        laws.append(law(block.kind, properties))
        at.append(block.dofs)
        ids.append(block.ids)
        kinds += [block.kind.name] * len(block.ids)
    numbers = np.concatenate(ids) if ids else np.zeros(0, dtype=np.int64)
    return InternalForces(join(laws), _directions(model.size, at), numbers, tuple(kinds))


def _law(block: Block):  # type: ignore[no-untyped-def]
    name = block.kind.name
    return ELEMENTS.named(name).text.law if name in ELEMENTS.names() else None


def _directions(size: int, at: list[Index]) -> sp.csc_array:
    rows, columns, values, first = [], [], [], 0
    for dofs in at:
        count, ends = dofs.shape
        for end in range(ends):
            free = np.flatnonzero(dofs[:, end] >= 0)
            rows.append(dofs[free, end])
            columns.append(first + free)
            values.append(np.full(len(free), 1.0 if end == ends - 1 else -1.0))
        first += count
    if not rows:
        return sp.csc_array((size, first))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csc_array(entries, shape=(size, first))
