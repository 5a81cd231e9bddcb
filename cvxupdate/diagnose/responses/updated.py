"""The model that a fit to responses ended at, for the problem file."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.results import Updated


def updated_model(point: ResponsePoint, notes: Sequence[str] = ()) -> Updated:
    """With a damping ratio of its own for every mode, and the faults of the sensors."""
    setting, n = point.setting, len(point.setting.model.parameters)
    faults = zip(setting.faults, (float(v) for v in point.fault_values), strict=True)
    zeta = point.damping[point.modes.rigid :]
    return Updated(setting.model, point.p[:n], zeta=zeta, faults=tuple(faults), notes=tuple(notes))
