"""The rows of a modal comparison one by one: which shapes are compared, the rows of eigenvalues and
shapes with their weights and labels."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.misfit import eigenvalue_row
from cvxupdate.residual.shape_forms import ShapeForm, deviations
from cvxupdate.residual.shape_gradients import ShapeRow
from cvxupdate.residual.shape_rows import Index, channel_rows, real_shapes

UNSTATED = 0.05  # deviation of a shape's entries where the table has none, of the largest

Rows = tuple[Real, Real, tuple[str, ...]]
"""Model − measured, weights, labels."""


def measured_shapes(
    model: Model, fit: Sequence[ModeTable], left_out: Collection[tuple[int, int]]
) -> tuple[ShapeRow, ...]:
    """Every measured shape of the tables that is compared, whatever mode of the model it is paired
    with (``place`` −1), those of the (table, mode) ``left_out`` apart."""
    out = []
    for k, table in enumerate(fit):
        if table.shapes is None:
            continue
        rows, shapes = channel_rows(table, model), real_shapes(table.shapes)
        given = np.nan if table.shape_std is None else table.shape_std
        stated = np.broadcast_to(given, shapes.shape)
        for i in range(len(table.frequency)):
            ok = (rows >= 0) & np.isfinite(shapes[i])
            if (k, i) in left_out or ok.sum() < 2:
                continue
            where = f"{table.origin.source}: the mode at {table.frequency[i]:.5g} Hz"
            std = deviations(stated[i][ok], shapes[i][ok], UNSTATED, where)
            out.append(ShapeRow(k, i, -1, rows[ok], shapes[i][ok], std, np.flatnonzero(ok)))
    return tuple(out)


def eigenvalue_rows(
    fit: Sequence[ModeTable], places: Sequence[Index], modes: Modes, heed: float
) -> Rows:
    """The eigenvalues of paired modes, (rad/s)²; their weights, times ``heed``, are one over the
    deviation 2 λ σ_f / f."""
    values, weights, labels = [], [], []
    for table, at in zip(fit, places, strict=False):
        for i in np.flatnonzero(at >= 0).tolist():
            measured, weight = eigenvalue_row(table, i)
            values.append(float(modes.eigenvalues[at[i]]) - measured)
            weights.append(heed * weight)
            labels.append(f"{table.origin.name}: {table.frequency[i]:.5g} Hz")
    return np.array(values, dtype=float), np.array(weights, dtype=float), tuple(labels)


def rows_of_shapes(
    fit: Sequence[ModeTable],
    shapes: Sequence[ShapeRow],
    modes: Modes,
    form: ShapeForm,
    weight: float,
    places: Sequence[str],
) -> Rows:
    """The rows of every shape in its ``form``, their weights times ``weight``; ``places`` are the
    labels of the model's DOFs."""
    values, weights, labels = [np.zeros(0)], [np.zeros(0)], []
    for row in shapes:
        found = form.rows(modes.shapes[row.sensors, row.place], row.measured, row.std)
        values.append(found.values)
        weights.append(weight * found.weights)
        table = fit[row.table]
        of = f"{table.origin.name}: shape of {table.frequency[row.mode]:.5g} Hz"
        labels += [
            of if e < 0 else f"{of} at {places[row.sensors[e]]}" for e in found.entry.tolist()
        ]
    return np.concatenate(values), np.concatenate(weights), tuple(labels)
