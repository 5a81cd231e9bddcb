"""The first linear system of any method: the model of the file against its recordings."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec
from cvxupdate.system import LinearSystem


def first_system(
    spec: Spec, model: Model, recordings: Sequence[Recording]
) -> tuple[LinearSystem, bool]:
    """The system at p = 0 of the method that [update] names, and whether its weights are relative
    only (the recordings state no deviations).

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    table = spec.update
    if table is not None and table.method == "ceam":
        from cvxupdate.update.ceam import residual_of as ceam_residual
        from cvxupdate.update.measured_modes import modal_tables

        fit, _ = modal_tables(recordings)
        relative = all(t.relative_only and t.shape_std is None for t in fit)
        point = ceam_residual(spec, model, recordings).evaluate(model.zero())
        return point.system(), relative
    if table is not None and table.method == "modal-dynamic":
        from cvxupdate.residual.modal_dynamic import dynamic_residual
        from cvxupdate.update.measured_modes import modal_tables

        fit, _ = modal_tables(recordings)
        relative = all(t.relative_only and t.shape_std is None for t in fit)
        zero = model.zero()
        return dynamic_residual(model, fit, zero).evaluate(zero).system(), relative
    if table is not None and table.method == "rfm":
        from cvxupdate.residual.frf import FrfResidual
        from cvxupdate.update.rfm import prepare

        of_all_lines = {"auto": "flexibility", "filter": "instrumental"}
        kind = of_all_lines.get(table.residual, table.residual)
        chosen = prepare(spec, model, recordings).chosen
        system = FrfResidual(model, chosen, kind).evaluate(model.zero()).system()
        return system, all(d.relative_only for d in chosen)
    from cvxupdate.update.modal_fit import residual_of

    residual = residual_of(spec, model, recordings)
    return residual.evaluate(model.zero()).system(), all(t.relative_only for t in residual.fit)
