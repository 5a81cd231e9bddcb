"""The model that a fit to responses ended at, for the problem file."""

from __future__ import annotations

from cvxupdate.diagnose.nominal.written import sayable, solid_of
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.results import Updated

SHIFTED = 1e-6  # relative shift of a frequency by the mesh below which there is none to tell of


def updated_model(
    point: ResponsePoint, notes: tuple[str, ...] = (), refine: int | None = None
) -> Updated:
    """With a damping ratio of its own for every mode, and the faults of the sensors; ``notes``:
    what else is to be said of the file; ``refine``: parts of each edge on which it is taken."""
    setting = point.setting
    kept, p, said = sayable(setting.model, point.p)
    faults = zip(setting.faults, (float(v) for v in point.fault_values), strict=True)
    shift = 100.0 * setting.mesh.worst(setting.top)
    solid, parted = solid_of(setting.model, point.p)
    notes = (*notes, *said, *(parted if refine else ()))
    if shift > 100.0 * SHIFTED:
        notes = (
            *notes,
            "The diagnosis took out what the mesh shifts the frequencies (up to "
            f"{shift:.2g} %); this file has them with it.",
        )
    zeta, share = point.damping[point.modes.rigid :], round(point.loss.hysteretic, 4)
    return Updated(
        kept,
        p,
        zeta=zeta,
        faults=tuple(faults),
        notes=notes,
        hysteretic=share,
        refine=refine,
        solid=solid,
    )
