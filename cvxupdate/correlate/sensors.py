"""What the sensors of a recording see of the model's modes, and where others would see more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate.result import SensorReport
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.reduction import qr_places, visibility

Index = NDArray[np.int64]
SEEN_MODES = 24
"""Modes in a sensor report at most."""


def sensor_report(
    model: Model, flexible: Modes, names: tuple[str, ...], rows: Index, top: float
) -> SensorReport | None:
    """What the sensors ``rows`` see of the modes up to ``top`` Hz (at most 24); None where there is
    nothing to see."""
    rows = np.unique(rows[rows >= 0])
    count = min(int(np.sum(flexible.frequencies <= top)), SEEN_MODES)
    if not count or not len(rows):
        return None
    phi = flexible.shapes[:, :count]
    alike_kind = (
        np.flatnonzero((model.dof_kind < 3) == bool(np.all(model.dof_kind[rows] < 3)))
        if _one_kind(model, rows)
        else np.arange(model.size)
    )
    try:
        seen = visibility(phi, rows, alike_kind)
    except (
        InputError
    ):  # a mode that moves no DOF of the sensors' kind (torsion, seen by translations)
        seen = visibility(phi, rows)
    better, condition = (), None
    if count <= len(rows) < len(alike_kind):
        try:
            chosen = qr_places(phi, len(rows), alike_kind)
            better, condition = (
                tuple(model.labels[i] for i in np.sort(chosen)),
                visibility(phi, chosen).condition,
            )
        except ModelError:
            pass
    return SensorReport(
        names,
        tuple(model.labels[i] for i in rows.tolist()),
        flexible.frequencies[:count],
        seen.rank,
        seen.condition,
        seen.alike,
        seen.peak,
        seen.independence,
        seen.says(),
        better,
        condition,
    )


def _one_kind(model: Model, rows: Index) -> bool:
    return len(np.unique(model.dof_kind[rows] < 3)) == 1
