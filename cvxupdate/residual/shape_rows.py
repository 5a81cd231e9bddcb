"""Measured mode shapes on the free DOFs of a model: real, entry by entry, and whether a shape moves
any sensor at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.types import ModeTable

Index = NDArray[np.int64]
# part of a shape's largest entry below which its entries are rounding (bending in y, at sensors in
# z)
UNSEEN = 1e-6
LIKE = 0.5  # MAC below which two shapes are not of one mode
Who = tuple[int, int]  # (table, measured mode)


def real_shapes(shapes: NDArray[np.complex128] | Real) -> Real:
    """Shapes (modes, channels) turned by the phase that makes each most nearly real; NaN entries
    stay."""
    if not np.iscomplexobj(shapes):
        return np.asarray(shapes, dtype=float)
    return np.real(rotated(shapes))


def channel_rows(table: ModeTable, model: Model) -> Index:
    """Place of every channel of ``table`` among the free DOFs; −1 for a DOF that a support holds.

    Raises
    ------
    RecordingError
        When a channel sits at a DOF that the model does not have.
    """
    held = set(model.node_ids.tolist())
    out = []
    for channel in table.channels:
        if channel.node not in held:
            raise RecordingError(
                f"{table.origin.source}: channel {channel.label} sits at node {channel.node}, "
                "which the model does not have."
            )
        out.append(model.place.get(channel.label, -1))
    return np.array(out, dtype=np.int64)


def shape_entries(model: Model, table: ModeTable, i: int) -> tuple[Index, Real]:
    """(free DOFs, values) of the entries of shape ``i`` that are known and that the model can
    move."""
    if table.shapes is None:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    rows, shape = channel_rows(table, model), real_shapes(table.shapes[i : i + 1])[0]
    ok = (rows >= 0) & np.isfinite(shape)
    return rows[ok], shape[ok]


def visible(shapes: Real, rows: Index) -> NDArray[np.bool_]:
    """Which shapes (N, m) move any of the DOFs ``rows`` by more than rounding (`UNSEEN` of their
    largest entry), (m,): else what is there is no shape."""
    return np.asarray(
        np.abs(shapes[rows]).max(axis=0, initial=0.0)
        > UNSEEN * np.abs(shapes).max(axis=0, initial=0.0)
    )


def alike(model: Model, tables: Sequence[ModeTable], a: Who, b: Who) -> bool:
    """Whether two measured shapes agree where both are known; True where fewer than two DOFs
    are."""
    (rows, x), (others, y) = (shape_entries(model, tables[k], i) for k, i in (a, b))
    _, at, to = np.intersect1d(rows, others, return_indices=True)
    if len(at) < 2:
        return True
    x, y = x[at], y[to]
    return bool((x @ y) ** 2 >= LIKE * (x @ x) * (y @ y))
