"""Tables of modes against the model: pairs, and everything that shapes allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real, Shapes
from cvxupdate.correlate.balance import ElementBalance
from cvxupdate.correlate.elements import ElementBatch
from cvxupdate.correlate.expand import balance_method, balanced, expansion
from cvxupdate.correlate.groups import element_batches, group_balance, group_matrices
from cvxupdate.correlate.mac import mac
from cvxupdate.correlate.pairing import Pairing
from cvxupdate.correlate.result import Geometry, ModePair, ShapeComparison
from cvxupdate.correlate.summary import Correlation, correlation
from cvxupdate.fe.labels import parse_label
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.reduction import Transformation

Index = NDArray[np.int64]
LARGEST = 30_000_000
"""Numbers in the condensed signatures of all elements (elements × DOFs of one × sensors) up to
which elements are judged one by one."""


def mode_pairs(
    table: ModeTable, flexible: Modes, places: Index, macs: Real
) -> tuple[ModePair, ...]:
    """The paired modes of one table in ascending measured frequency; ``places`` (modes,) among the
    flexible ones, −1 unpaired."""
    rank = ranks(table.frequency)
    out = []
    for i in np.argsort(table.frequency, kind="stable").tolist():
        at = int(places[i])
        if at < 0:
            continue
        measured, model = float(table.frequency[i]), float(flexible.frequencies[at])
        std = None if table.relative_only else float(table.frequency_std[i])
        damping = float(table.damping[i])
        by = (
            "file" if table.pairs[i] == at + 1 else "shape" if np.isfinite(macs[i]) else "frequency"
        )
        out.append(
            ModePair(
                table.origin.name,
                table.origin.use,
                int(rank[i]),
                measured,
                std,
                damping if np.isfinite(damping) else None,
                at + 1,
                model,
                100.0 * (model - measured) / measured,
                float(macs[i]) if np.isfinite(macs[i]) else None,
                by,
            )
        )
    return tuple(out)


def ranks(frequency: Real) -> Index:
    """1 for the lowest measured frequency, 2 for the next …"""
    out = np.empty(len(frequency), dtype=np.int64)
    out[np.argsort(frequency, kind="stable")] = np.arange(1, len(frequency) + 1)
    return out


def compare_shapes(
    model: Model,
    matrices: Matrices,
    flexible: Modes,
    table: ModeTable,
    shapes: Real,
    rows: Index,
    places: Index,
    geometry: Geometry | None,
) -> tuple[ShapeComparison | None, tuple[str, ...]]:
    """Every measure of shapes for one table; None (with a note) where no two channels of a paired
    mode have values.

    Parameters
    ----------
    shapes : (modes, channels) real, NaN where not measured. rows : (channels,) places among the
    free DOFs, −1 where held.
    places : (modes,) partner among the ``flexible`` modes, −1 unpaired.
    """
    name = table.origin.name
    notes: list[str] = []
    at = _sensors(table, shapes, rows, places, notes)
    if not len(at.order):
        return None, (
            *notes,
            f"{name}: no paired mode has values at two sensors or more; shapes were not compared.",
        )
    fx, x = table.frequency[at.measured], at.x[:, at.measured]
    top = int(min(max(places[at.order].max() + 2, len(at.measured)), flexible.shapes.shape[1]))
    a, fa = flexible.shapes[at.rows][:, :top], flexible.frequencies[:top]
    pairs = _pairs(at, places, a, x)
    e = _expanded(
        model, matrices, flexible, at, (pairs.model, top), x, fx, name, notes, geometry is not None
    )
    found = _correlated(model, matrices, table, at, pairs, (fa, a), (fx, x), e)
    groups, names = _groups(model, matrices, found, x, fx, () if e.batches else e.several or ())
    return ShapeComparison(
        name,
        table.origin.use,
        found.labels,
        model.dof_node[at.rows],
        model.dof_kind[at.rows],
        ranks(table.frequency)[at.order],
        places[at.order] + 1,
        fa,
        fx,
        found,
        e.transformation.method if e.transformation is not None else "",
        e.ids,
        balance_method(e.several, flexible, at.rows),
        names,
        groups,
        _translations(model, geometry, flexible.shapes[:, pairs.model], a[:, pairs.model]),
    ), (*notes, *(f"{name}: {n}" for n in found.notes))


def _correlated(
    model: Model,
    matrices: Matrices,
    table: ModeTable,
    at: _Sensors,
    pairs: Pairing,
    own: tuple[Real, Real],
    measured: tuple[Real, Real],
    e: _Expanded,
) -> Correlation:
    """Every measure of frequencies (Hz) and shapes at the sensors, ``own`` and ``measured``."""
    return correlation(
        *own,
        *measured,
        std=None if table.relative_only else table.frequency_std[at.measured],
        pairing=pairs,
        labels=tuple(model.labels[i] for i in at.rows.tolist()),
        K=matrices.K,
        M=matrices.M,
        transformation=e.transformation,
        expansions=e.several,
        elements=e.batches,
    )


@dataclass(frozen=True)
class _Sensors:
    """Where a table has values: ``rows`` (sensors,) among the free DOFs, ``x`` (sensors, modes);
    modes in ascending frequency: ``measured`` at two sensors or more, ``order`` those also
    paired."""

    rows: Index
    x: Real
    measured: Index
    order: Index


def _sensors(
    table: ModeTable, shapes: Real, rows: Index, places: Index, notes: list[str]
) -> _Sensors:
    seen = np.flatnonzero(rows >= 0)
    seen = seen[np.sort(np.unique(rows[seen], return_index=True)[1])]
    if len(seen) < len(rows):
        notes.append(
            f"{table.origin.name}: {len(rows) - len(seen)} of {len(rows)} channels sit on a "
            "support or repeat a DOF, and were left out of the shapes."
        )
    x = shapes[:, seen].T
    known = np.sum(np.isfinite(x), axis=0) >= 2
    measured = [int(i) for i in np.argsort(table.frequency, kind="stable") if known[i]]
    order = [i for i in measured if places[i] >= 0]
    return _Sensors(
        rows[seen], x, np.array(measured, dtype=np.int64), np.array(order, dtype=np.int64)
    )


def _pairs(at: _Sensors, places: Index, a: Real, x: Real) -> Pairing:
    """The given partners as a `Pairing` of the columns of ``a`` and ``x``."""
    place_of = {int(i): k for k, i in enumerate(at.measured)}
    columns = np.array([place_of[int(i)] for i in at.order], dtype=np.intp)
    partner = places[at.order].astype(np.intp)
    return Pairing(
        partner,
        columns,
        mac(a, x)[partner, columns],
        np.setdiff1d(np.arange(x.shape[1]), columns),
        np.setdiff1d(np.arange(a.shape[1]), partner),
    )


@dataclass(frozen=True)
class _Expanded:
    """What expands the shapes, what the force balance uses (one for each measured mode), and the
    elements that it judges; None or empty where that is impossible."""

    transformation: Transformation | None = None
    several: list[Transformation] | None = None
    batches: Sequence[ElementBatch] = ()
    ids: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


def _expanded(
    model: Model,
    matrices: Matrices,
    flexible: Modes,
    at: _Sensors,
    modes: tuple[NDArray[np.intp], int],
    x: Real,
    fx: Real,
    name: str,
    notes: list[str],
    by_element: bool,
) -> _Expanded:
    transformation, said = expansion(matrices, flexible, at.rows, *modes)
    notes += [f"{name}: {line}" for line in said]
    if transformation is None:
        return _Expanded()
    several, said = balanced(matrices, flexible, at.rows, x, fx)
    notes += [f"{name}: {line}" for line in said]
    if several is None or not by_element:
        return _Expanded(transformation, several)
    return _Expanded(transformation, several, *_elements(model, len(at.rows), name, notes))


def _elements(
    model: Model, sensors: int, name: str, notes: list[str]
) -> tuple[Sequence[ElementBatch], Index]:
    """Element matrices and numbers; none, with a note, where there are too many."""
    batches, ids = element_batches(model)
    if sum(b.dofs.size for b in batches) * sensors > LARGEST:
        notes.append(
            f"{name}: {len(ids)} elements are too many to judge one by one; the force balance "
            "is given by group."
        )
        return (), ids[:0]
    return batches, ids


def shape_macs(flexible: Modes, shapes: Real, rows: Index, places: Index) -> Real:
    """MAC of every measured mode with its partner, (modes,); NaN where it has none, or fewer than
    two values. Arguments as above."""
    out = np.full(len(places), np.nan)
    for i, at in enumerate(places.tolist()):
        ok = (rows >= 0) & np.isfinite(shapes[i])
        if at >= 0 and ok.sum() >= 2:
            out[i] = mac(flexible.shapes[rows[ok], at], shapes[i][ok])[0, 0]
    return out


def _groups(
    model: Model,
    m: Matrices,
    found: Correlation,
    x: Shapes,
    fx: Real,
    several: Sequence[Transformation],
) -> tuple[ElementBalance | None, tuple[str, ...]]:
    """The force balance by group, with their names; None without expansions or pairs."""
    groups = group_matrices(model) if several and found.complete else ()
    if len(groups) < 2:
        return None, ()
    which = [int(found.pairing.measured[k]) for k in found.complete]
    return group_balance(
        groups, m.K, m.M, x[:, which], fx[which], [several[k] for k in which]
    ), tuple(g.name for g in groups)


def node_translations(model: Model, shape: Real) -> Real:
    """Translations (nodes, 3) of a shape (N,); zero where held."""
    out = np.zeros((len(model.node_ids), 3))
    rows = np.flatnonzero(model.dof_kind < 3)
    out[model.dof_node[rows], model.dof_kind[rows]] = shape[rows]
    for tied, _ in model.ties:
        node, kind = parse_label(tied)
        if kind < 3:
            out[model.node_ids == node, kind] = shape[model.place[tied]]
    return out


def _translations(
    model: Model, geometry: Geometry | None, shapes: Real, at_sensors: Real
) -> Real | None:
    """(nodes, 3, P) translations of mode shapes at every node, with the largest entry at the
    sensors at 1; None for a model without coordinates."""
    if geometry is None:
        return None
    peak = at_sensors[np.nanargmax(np.abs(at_sensors), axis=0), np.arange(at_sensors.shape[1])]
    return np.stack([node_translations(model, shape) for shape in (shapes / peak).T], axis=2)
