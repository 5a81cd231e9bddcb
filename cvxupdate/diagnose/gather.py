"""From a problem to its evidence: responses where there are any to fit, else tables of modes."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.modes.worth import mesh_of_tables
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import held_dofs, release_from
from cvxupdate.diagnose.responses.data import prepare
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.worth import mesh_for
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.physics import effect_names
from cvxupdate.physics.effect import MODES, RATIOS, RESPONSES
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import Spec

SHEAR = "shear_deformation"  # an effect that changes what the mesh is worth


def gathered(
    spec: Spec, model: Model, recordings: Sequence[Recording], progress: Progress
) -> Evidence:
    """What the recordings of a problem say of its model.

    Raises
    ------
    InputError
        When there is no recording to fit.
    """
    if not any(r.origin.use == "fit" for r in recordings):
        raise InputError(f'{spec.path}: diagnose needs a recording with use = "fit". Add one.')
    usable = [r for r in recordings if isinstance(r, FrequencyResponse | TimeHistory)]
    if any(r.origin.use == "fit" for r in usable):
        return _responses(spec, model, usable, progress)
    return _modes(spec, model, [r for r in recordings if isinstance(r, ModeTable)], progress)


def _names(spec: Spec, told_by: str) -> tuple[str, ...]:
    asked = spec.diagnose.physics
    return tuple(n for n in effect_names(told_by) if asked is None or n in asked)


def _responses(
    spec: Spec,
    model: Model,
    recordings: Sequence[FrequencyResponse | TimeHistory],
    progress: Progress,
) -> ResponseEvidence:
    data, names = prepare(recordings), _names(spec, RESPONSES)
    mesh = mesh_for(spec, model, data, SHEAR in names)
    start = with_nuisance(undamped(mesh.on(model)), scatter=spec.diagnose.scatter)
    held, release = held_dofs(spec, model), release_from(spec, mesh)
    return ResponseEvidence(model, start, data, mesh, names, held, release, progress)


def _modes(
    spec: Spec, model: Model, tables: Sequence[ModeTable], progress: Progress
) -> ModesEvidence:
    mesh = mesh_of_tables(spec, model, tables, SHEAR in _names(spec, MODES))
    start = with_nuisance(undamped(mesh.on(model)), scatter=spec.diagnose.scatter)
    order = [
        k
        for fitted in (True, False)
        for k, r in enumerate(spec.recordings)
        if r.kind == "modes" and (r.use == "fit") == fitted
    ]
    return ModesEvidence(
        model,
        start,
        prepared(tables),
        mesh,
        _names(spec, MODES),
        _names(spec, RATIOS),
        held_dofs(spec, model),
        release_from(spec, mesh),
        tuple(order),
        progress,
    )
