"""Element matrices of a `Model` as batches and by group, and the force balance of whole groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real, Shapes
from cvxupdate.correlate.balance import ElementBalance, ModeImbalance, explained, mode_imbalances
from cvxupdate.correlate.elements import ElementBatch
from cvxupdate.fe.model import Model
from cvxupdate.reduction.transformation import Transformation

Index = NDArray[np.int64]


@dataclass(frozen=True)
class GroupMatrices:
    """K and M of one group over the free DOFs, sparse (N, N); K in N/m."""

    name: str
    K: Any
    M: Any


def element_batches(model: Model, p: Real | None = None) -> tuple[tuple[ElementBatch, ...], Index]:
    """The model's elements that have stiffness, as batches, and their ids (elements,) in the same
    order.

    Given matrices are left out: their blocks are entries, not elements (`group_matrices` holds
    them).
    """
    batches, ids = [], []
    for block, values in zip(model.blocks, model.properties(p), strict=True):
        if block.kind.name == "matrix":
            continue
        made = block.combine(block.scalars(values))
        if "K" not in made or not np.any(made["K"]):
            continue
        shape = (*block.dofs.shape, block.dofs.shape[1])
        K, M = (
            np.broadcast_to(made[name], shape) if name in made else np.zeros(shape) for name in "KM"
        )
        batches.append(ElementBatch(block.dofs, np.ascontiguousarray(K), np.ascontiguousarray(M)))
        ids.append(block.ids)
    return tuple(batches), np.concatenate(ids) if ids else np.zeros(0, dtype=np.int64)


def group_matrices(model: Model, p: Real | None = None) -> tuple[GroupMatrices, ...]:
    """K and M of every named group, and of every given matrix without a group, in the order of the
    model."""
    parts: dict[str, dict[str, list[tuple[Index, Index, Real]]]] = {}
    for block, values in zip(model.blocks, model.properties(p), strict=True):
        made = block.combine(block.scalars(values))
        names = [
            g or (f"matrix {i}" if block.kind.name == "matrix" else "")
            for g, i in zip(block.groups, block.ids.tolist(), strict=True)
        ]
        for name in dict.fromkeys(n for n in names if n):
            rows = np.flatnonzero([n == name for n in names])
            for matrix in ("K", "M"):
                if matrix in made:
                    parts.setdefault(name, {"K": [], "M": []})[matrix].append(
                        _triplets(
                            block.dofs[rows],
                            np.broadcast_to(made[matrix], (*block.dofs.shape, block.dofs.shape[1]))[
                                rows
                            ],
                        )
                    )
    return tuple(
        GroupMatrices(name, *(_sparse(found[m], model.size) for m in ("K", "M")))
        for name, found in parts.items()
    )


def group_balance(
    groups: Sequence[GroupMatrices],
    K: Any,
    M: Any,
    phi_x: Shapes,
    f_x: Real,
    transformation: Transformation | Sequence[Transformation] | None = None,
) -> ElementBalance:
    """As `element_balance`, with a whole group in the place of an element: which group explains the
    imbalance by one factor on its stiffness (or mass). Arguments and errors as there."""
    return explained(
        [_group_sums(groups, mode) for mode in mode_imbalances(K, M, phi_x, f_x, transformation)]
    )


def _group_sums(
    groups: Sequence[GroupMatrices], mode: ModeImbalance
) -> tuple[Real, Real, Real, Real, float]:
    """One mode's s·f and s·s of every group, for stiffness and mass signatures s, and f·f."""
    sums = []
    for forces in (
        np.column_stack([g.K @ mode.phi for g in groups]),
        np.column_stack([mode.eigenvalue * (g.M @ mode.phi) for g in groups]),
    ):
        condensed = forces if mode.T is None else mode.T.matrix.T @ forces
        signature = condensed * mode.scale[:, None]
        sums += [np.real(signature.conj().T @ mode.force), np.sum(np.abs(signature) ** 2, axis=0)]
    return sums[0], sums[1], sums[2], sums[3], float(np.sum(np.abs(mode.force) ** 2))


def _triplets(dofs: Index, values: Real) -> tuple[Index, Index, Real]:
    i = np.broadcast_to(dofs[:, :, None], values.shape).reshape(-1)
    j = np.broadcast_to(dofs[:, None, :], values.shape).reshape(-1)
    keep = (i >= 0) & (j >= 0)
    return i[keep], j[keep], values.reshape(-1)[keep]


def _sparse(parts: list[tuple[Index, Index, Real]], size: int) -> sp.csr_array:
    if not parts:
        return sp.csr_array((size, size))
    i, j, v = (np.concatenate([p[k] for p in parts]) for k in range(3))
    return sp.csr_array(sp.coo_array((v, (i, j)), shape=(size, size)))
