"""The equation of motion of one measured mode, for the clause that reproduces it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.convex import ModeRows
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.ceam import CeamResidual
from cvxupdate.residual.ceam_modes import assigned_modes


def mode_rows(model: Model, tables: Sequence[ModeTable], number: int, exactly: bool) -> ModeRows:
    """Rows of mode ``number`` (1 = first) of ``tables``.

    An incomplete shape is expanded by the model as it stands, its unmeasured entries as uncertain
    as they are large. That leaves a clause within deviations meaning, locally; an exact one would
    hold the shape of a model that is about to be changed, and is refused.

    Raises
    ------
    InputError
        When there is no such mode, it has no shape, or an exact clause would rest on an expanded
        shape.
    """
    rows = [(t, i) for t in tables for i in range(len(t.frequency))]
    if number > len(rows):
        raise InputError(
            f"constraints.modes: mode = {number}, but only {len(rows)} modes are fitted."
        )
    table, i = rows[number - 1]
    if table.shapes is None:
        raise InputError(
            f"constraints.modes: mode {number} ({table.frequency[i]:.5g} Hz) has no "
            "shape, so its equation of motion is not known."
        )
    one = replace(
        table,
        frequency=table.frequency[i : i + 1],
        frequency_std=table.frequency_std[i : i + 1],
        damping=table.damping[i : i + 1],
        damping_std=table.damping_std[i : i + 1],
        shapes=table.shapes[i : i + 1],
        pairs=table.pairs[i : i + 1],
        covariance=None,
        shape_std=None
        if table.shape_std is None
        else np.broadcast_to(table.shape_std, np.shape(table.shapes))[i : i + 1],
    )
    residual = CeamResidual(model, assigned_modes(model, [one]), "null-space", model.zero())
    if not residual.exact and exactly:
        raise InputError(
            f"constraints.modes: mode {number} was not measured at every DOF. "
            "Expanded by the model that is to be corrected, its shape is wrong where "
            "nothing was measured, and an exact clause would keep it wrong. Give "
            "`within`, in standard deviations, or measure the other DOFs."
        )
    system = residual.evaluate(model.zero()).system()
    return ModeRows(system.A, system.b, f"mode {number} ({table.frequency[i]:.5g} Hz)")
