"""Which mode of the model each measured mode is, at the start and along the iteration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cvxupdate.correlate import pair_frequencies, pair_modes
from cvxupdate.errors import InputError, RecordingError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable

Index = NDArray[np.int64]
MARGIN = 6  # model modes beyond the highest paired one, for modes that cross


def real_shapes(shapes: NDArray[np.complex128] | Real) -> Real:
    """Shapes (modes, channels) turned by the phase that makes each most nearly real; NaN entries stay."""
    if not np.iscomplexobj(shapes):
        return np.asarray(shapes, dtype=float)
    turn = np.exp(-0.5j * np.angle(np.nansum(shapes**2, axis=1)))
    return np.real(shapes * turn[:, None])


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
            raise RecordingError(f"{table.origin.source}: channel {channel.label} sits at node {channel.node}, which the model does not have.")
        out.append(model.place.get(channel.label, -1))
    return np.array(out, dtype=np.int64)


@dataclass(frozen=True)
class Start:
    """The initial pairing: ``modes`` of the initial model and, for each table, the place of every measured mode among all of them (−1: none)."""

    modes: Modes
    places: tuple[Index, ...]


def needed_modes(tables: Sequence[ModeTable]) -> int:
    """How many flexible modes of the model the pairing may need."""
    fixed = max((int(t.pairs.max(initial=0)) for t in tables), default=0)
    count = sum(len(t.frequency) for t in tables)
    return max(fixed, count) + MARGIN


def start_pairing(model: Model, modes: Modes, tables: Sequence[ModeTable], rule: str = "auto") -> Start:
    """Pair all measured modes at once, so that no model mode serves twice.

    A mode that the problem file pairs keeps its partner. The others go by MAC where they have shapes, else by frequency (the assignment of
    least squared relative distance, whatever the order). ``rule`` "fixed", "mac" or "frequency" forbids the other ways.

    Raises
    ------
    InputError
        When the rule cannot pair every mode: a fixed partner that is not there or is used twice, no shapes for "mac".
    """
    flexible = modes.flexible()
    places = [np.full(len(t.frequency), -1, dtype=np.int64) for t in tables]
    taken: dict[int, str] = {}
    open_: list[tuple[int, int]] = []
    for k, table in enumerate(tables):
        for i, pair in enumerate(table.pairs.tolist()):
            if pair <= 0 or rule in ("mac", "frequency"):
                if rule == "fixed":
                    raise InputError(f"{table.origin.source}: pairing is fixed, but the mode at {table.frequency[i]:.4g} Hz names no `mode`. "
                                     "Give one.")
                open_.append((k, i))
                continue
            if pair > len(flexible.eigenvalues):
                raise InputError(f"{table.origin.source}: mode = {pair}, but the model has only {len(flexible.eigenvalues)} flexible modes.")
            if pair in taken:
                raise InputError(f"{table.origin.source}: the measured modes {taken[pair]} and {table.frequency[i]:.4g} Hz are both paired with "
                                 f"mode {pair} of the model. Give each its own.")
            taken[pair] = f"{table.frequency[i]:.4g} Hz"
            places[k][i] = pair - 1
    open_ = _by_shape(model, flexible, tables, places, taken, open_, rule)
    if open_ and rule == "mac":
        raise InputError("pairing is by MAC, but a measured mode has no shape, or none of the model's resembles it. Use pairing = \"auto\".")
    free = np.array([i for i in range(len(flexible.eigenvalues)) if i + 1 not in taken], dtype=np.int64)
    if open_:
        measured = np.array([tables[k].frequency[i] for k, i in open_])
        found = pair_frequencies(flexible.frequencies[free], measured)
        for a, x in zip(found.model, found.measured, strict=True):
            k, i = open_[int(x)]
            places[k][i] = free[a]
    return Start(modes, tuple(np.where(p >= 0, p + modes.rigid, -1) for p in places))


def _by_shape(model: Model, flexible: Modes, tables: Sequence[ModeTable], places: list[Index], taken: dict[int, str],
              open_: list[tuple[int, int]], rule: str) -> list[tuple[int, int]]:
    """Pair by MAC the open modes that have shapes; returns those still open."""
    if rule == "frequency":
        return open_
    left = [(k, i) for k, i in open_ if tables[k].shapes is None]
    for k, table in enumerate(tables):
        mine = [i for kk, i in open_ if kk == k]
        if table.shapes is None or not mine:
            continue
        rows = channel_rows(table, model)
        seen = rows >= 0
        free = np.array([i for i in range(len(flexible.eigenvalues)) if i + 1 not in taken], dtype=np.int64)
        shapes = real_shapes(table.shapes)[mine][:, seen].T
        known = np.sum(np.isfinite(shapes), axis=0) >= 2
        left += [(k, i) for i, ok in zip(mine, known, strict=True) if not ok]
        chosen = [i for i, ok in zip(mine, known, strict=True) if ok]
        if not chosen:
            continue
        found = pair_modes(flexible.shapes[rows[seen]][:, free], shapes[:, known], flexible.frequencies[free], table.frequency[chosen], threshold=0.3)
        for a, x in zip(found.model, found.measured, strict=True):
            places[k][chosen[int(x)]] = free[a]
            taken[int(free[a]) + 1] = f"{table.frequency[chosen[int(x)]]:.4g} Hz"
        left += [(k, chosen[int(x)]) for x in found.unpaired]
    return left


def follow(shapes: Real, M: sp.csc_array, modes: Modes) -> Index:
    """Where earlier mass-normalised ``shapes`` (N, m) went among ``modes``: the assignment of largest Σ (φᵀ M φ')², (m,).

    Modes that cross keep their identity, because the shapes of one structure stay orthogonal in its mass matrix.
    """
    likeness = (shapes.T @ (M @ modes.shapes)) ** 2
    rows, columns = linear_sum_assignment(likeness, maximize=True)
    return np.asarray(columns[np.argsort(rows)], dtype=np.int64)
