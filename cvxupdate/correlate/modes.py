"""Tables of modes against the model: pairs, and everything that shapes allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real, Shapes
from cvxupdate.correlate.balance import ElementBalance, mode_imbalances
from cvxupdate.correlate.groups import element_batches, group_balance, group_matrices
from cvxupdate.correlate.mac import mac
from cvxupdate.correlate.pairing import Pairing
from cvxupdate.correlate.result import Geometry, ModePair, ShapeComparison
from cvxupdate.correlate.summary import correlation
from cvxupdate.errors import ModelError
from cvxupdate.fe.build import parse_label
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.reduction import Transformation, dynamic, guyan, partition, serep

Index = NDArray[np.int64]
NOISY = 0.5
"""Fraction of the elastic forces out of balance above which the shapes are taken to be noisy."""
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
    notes = []
    seen = np.flatnonzero(rows >= 0)
    seen = seen[np.sort(np.unique(rows[seen], return_index=True)[1])]
    if len(seen) < len(rows):
        notes.append(
            f"{name}: {len(rows) - len(seen)} of {len(rows)} channels sit on a support or "
            "repeat a DOF, and were left out of the shapes."
        )
    sensors, x = rows[seen], shapes[:, seen].T
    known = np.sum(np.isfinite(x), axis=0) >= 2
    order = np.array(
        [i for i in np.argsort(table.frequency, kind="stable") if places[i] >= 0 and known[i]],
        dtype=np.int64,
    )
    if not len(order):
        return None, (
            *notes,
            f"{name}: no paired mode has values at two sensors or more; shapes were not compared.",
        )
    measured = np.array(
        [i for i in np.argsort(table.frequency, kind="stable") if known[i]], dtype=np.int64
    )
    top = int(min(max(places[order].max() + 2, len(measured)), flexible.shapes.shape[1]))
    a, fa = flexible.shapes[sensors][:, :top], flexible.frequencies[:top]
    place_of = {int(i): k for k, i in enumerate(measured)}
    columns = np.array([place_of[int(i)] for i in order], dtype=np.intp)
    partner = places[order].astype(np.intp)
    macs = mac(a, x[:, measured])
    pairs = Pairing(
        partner,
        columns,
        macs[partner, columns],
        np.setdiff1d(np.arange(len(measured)), columns),
        np.setdiff1d(np.arange(top), partner),
    )
    fx = table.frequency[measured]
    transformation, said = expansion(matrices, flexible, sensors, partner, top)
    notes += [f"{name}: {line}" for line in said]
    several, said = (
        balanced(matrices, flexible, sensors, x[:, measured], fx)
        if transformation is not None
        else (None, ())
    )
    balance_by = (
        ""
        if not several
        else "dynamic expansion at each measured frequency"
        if several[0].frequency is not None
        else (
            f"{several[0].method} on {smooth_modes(flexible, sensors)} modes of the model, "
            "which smooths the shapes"
        )
    )
    notes += [f"{name}: {line}" for line in said]
    batches, ids = (
        element_batches(model)
        if geometry is not None and several is not None
        else ((), np.zeros(0, dtype=np.int64))
    )
    if sum(b.dofs.size for b in batches) * len(sensors) > LARGEST:
        notes.append(
            f"{name}: {len(ids)} elements are too many to judge one by one; the force balance "
            "is given by group."
        )
        batches, ids = (), ids[:0]
    std = None if table.relative_only else table.frequency_std[measured]
    labels = tuple(model.labels[i] for i in sensors.tolist())
    found = correlation(
        fa,
        a,
        fx,
        x[:, measured],
        std=std,
        pairing=pairs,
        labels=labels,
        K=matrices.K,
        M=matrices.M,
        transformation=transformation,
        expansions=several,
        elements=batches,
    )
    groups: ElementBalance | None = None
    names: tuple[str, ...] = ()
    if several is not None and not batches and found.complete:
        groups, names = _groups(
            model, matrices, found.complete, columns, x[:, measured], fx, several
        )
    rank = ranks(table.frequency)
    return ShapeComparison(
        name,
        table.origin.use,
        labels,
        model.dof_node[sensors],
        model.dof_kind[sensors],
        rank[order],
        places[order] + 1,
        fa,
        fx,
        found,
        transformation.method if transformation is not None else "",
        ids,
        balance_by,
        names,
        groups,
        None
        if geometry is None
        else _translations(model, flexible.shapes[:, partner], a[:, partner]),
    ), (*notes, *(f"{name}: {n}" for n in found.notes))


def shape_macs(flexible: Modes, shapes: Real, rows: Index, places: Index) -> Real:
    """MAC of every measured mode with its partner, (modes,); NaN where it has none, or fewer than
    two values. Arguments as above."""
    out = np.full(len(places), np.nan)
    for i, at in enumerate(places.tolist()):
        ok = (rows >= 0) & np.isfinite(shapes[i])
        if at >= 0 and ok.sum() >= 2:
            out[i] = mac(flexible.shapes[rows[ok], at], shapes[i][ok])[0, 0]
    return out


def expansion(
    m: Matrices, flexible: Modes, sensors: Index, partner: Index, top: int
) -> tuple[Transformation | None, tuple[str, ...]]:
    """SEREP from the model's modes in the measured range, from the paired ones alone where the
    sensors are few, else Guyan; None with the reason where the sensors do not determine the model's
    motion at all."""
    for chosen in (np.arange(top), np.unique(partner)):
        if len(chosen) > len(sensors):
            continue
        try:
            return serep(flexible.shapes[:, chosen], sensors), ()
        except ModelError:
            continue
    try:
        return guyan(partition(m.K, m.M, sensors)), (
            "the sensors cannot distinguish the model's modes; shapes were expanded "
            "statically (Guyan).",
        )
    except ModelError:
        return None, (
            "the sensors cannot distinguish the model's modes, and do not hold it: no "
            "orthogonality, energies or force balance.",
        )


def balanced(
    m: Matrices, flexible: Modes, sensors: Index, x: Real, fx: Real
) -> tuple[list[Transformation] | None, tuple[str, ...]]:
    """The transformations that the force balance uses, one for each measured mode, with what to say
    about them.

    Dynamic expansion at each measured frequency balances every unmeasured DOF and is the sharpest,
    but it keeps the noise of the shapes, which stiffness turns into force. Where more than half of
    the elastic forces is out of balance, that is noise: the shapes are then smoothed by SEREP.
    """
    try:
        split = partition(m.K, m.M, sensors)
        several = [dynamic(split, float(f)) for f in fx]
    except ModelError:
        return None, (
            "a measured frequency is a natural frequency of the structure held at its "
            "sensors: the force balance was left out.",
        )
    whole = np.flatnonzero(~np.any(np.isnan(x), axis=0))
    if not len(whole):
        return several, ()
    forces = mode_imbalances(m.K, m.M, x[:, whole], fx[whole], [several[k] for k in whole.tolist()])
    level = float(np.sqrt(np.mean([np.sum(np.abs(mode.force) ** 2) for mode in forces])))
    if level <= NOISY:
        return several, ()
    said = (
        f"{100 * level:.0f} % of the elastic forces of the measured shapes is out of balance: "
        "that is noise rather than a fault of the model"
    )
    try:
        smooth = serep(flexible.shapes[:, : smooth_modes(flexible, sensors)], sensors)
    except ModelError:
        return several, (f"{said}, and the force balance cannot be trusted.",)
    return [smooth] * len(fx), (
        f"{said}. For the force balance the shapes were smoothed by SEREP on "
        f"{smooth_modes(flexible, sensors)} modes of the model.",
    )


def smooth_modes(flexible: Modes, sensors: Index) -> int:
    """Modes that smooth measured shapes: at most half as many as there are sensors."""
    return min(flexible.shapes.shape[1], len(sensors) // 2)


def _groups(
    model: Model,
    m: Matrices,
    complete: Sequence[int],
    columns: Index,
    x: Shapes,
    fx: Real,
    several: Sequence[Transformation],
) -> tuple[ElementBalance | None, tuple[str, ...]]:
    groups = group_matrices(model)
    if len(groups) < 2:
        return None, ()
    which = [int(columns[k]) for k in complete]
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


def _translations(model: Model, shapes: Real, at_sensors: Real) -> Real:
    """(nodes, 3, P) translations of mode shapes at every node, with the largest entry at the
    sensors at 1."""
    peak = at_sensors[np.nanargmax(np.abs(at_sensors), axis=0), np.arange(at_sensors.shape[1])]
    return np.stack([node_translations(model, shape) for shape in (shapes / peak).T], axis=2)
