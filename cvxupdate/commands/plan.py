"""`plan`: what to measure, from the model alone."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.commands.plan_lines import MOST_PLACES, information, line_sets
from cvxupdate.commands.plan_places import (
    CLOSE,
    DRIVEN,
    candidates,
    crowd,
    exciter_set,
    indicator,
    sensor_sets,
)
from cvxupdate.commands.planned import Options, Planned
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model

if TYPE_CHECKING:
    from cvxupdate.spec.given import Given

MORE = 1.5
"""Sensors for each mode where nothing is asked for: some to spare for a broken channel."""
SHARP = 0.3
"""MMIF below which a mode is shown by its dip."""


def plan(given: Given, options: Options | None = None) -> Planned:
    """Sensors, exciters, frequency lines and the accuracy needed for the model and the parameters
    of a problem, in any of its forms. Its recordings, if it has any, are not read.

    Raises
    ------
    InputError
        For a fault of the file, or a request that the model cannot meet.
    """
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.fe.build import build_model
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.spec import spec_of

    begin, o = time.perf_counter(), Options() if options is None else options
    spec = spec_of(given)
    model = build_model(spec)
    modes = model_modes(model, o.modes).flexible()
    if not len(modes.eigenvalues):
        raise InputError(f"{spec.path}: the model has no mode that is not rigid.")
    few = len(modes.eigenvalues) < o.modes
    mass = np.asarray(model.matrices().M.diagonal())
    places = candidates(model)
    wanted = o.sensors or min(int(np.ceil(MORE * len(modes.eigenvalues))), len(places))
    first = sensor_sets(model, modes, mass, wanted, None)[0].labels
    exciters = exciter_set(model, modes, o.exciters, first)
    told = information(model, modes.frequencies, exciters.labels, o)
    sensors = sensor_sets(model, modes, mass, wanted, told)
    exciters = exciter_set(model, modes, len(exciters.labels), sensors[0].labels)
    notes = [f"the model has {len(modes.eigenvalues)} modes that are not rigid"] if few else []
    if model.parameters and told is None:
        notes.append(
            f"sensors are not chosen by what they tell of the parameters: {len(places)} free "
            f"translations are more than {MOST_PLACES}"
        )
    lines, log, said = (
        line_sets(model, modes.frequencies, sensors[0].labels, exciters.labels, o)
        if model.parameters
        else ((), ((), ()), [])
    )
    shown = indicator(model, modes, sensors[0].labels, exciters.labels)
    notes += _said(model, exciters.drive, shown.dips, modes.frequencies, len(exciters.labels))
    return Planned(
        spec.name,
        spec.title,
        spec.shown,
        time.perf_counter() - begin,
        o.line(),
        tuple(modes.frequencies.tolist()),
        sensors,
        exciters,
        shown,
        tuple(q.name for q in model.parameters),
        lines,
        log,
        o.noise,
        o.accuracy,
        (*notes, *said),
        geometry_of(spec, model),
    )


def _said(
    model: Model,
    drive: tuple[float, ...],
    dips: tuple[float, ...],
    frequencies: np.ndarray,
    exciters: int,
) -> list[str]:
    said = []
    rotations = int(np.count_nonzero(model.dof_kind >= 3))
    if rotations:
        said.append(
            f"{rotations} rotations of the model are no candidates: common sensors do not measure "
            "them. Where they matter (joints, short beams), they must be expanded"
        )
    weak = [k + 1 for k, d in enumerate(drive) if d < DRIVEN]
    if weak:
        said.append(
            f"mode {', '.join(map(str, weak))}: driven with less than a tenth of what another "
            "place would give it. Ask for more --exciters, or move them in a second run"
        )
    most = crowd(frequencies)
    if most > exciters:
        said.append(
            f"{most} modes lie within {100 * CLOSE:g} % of one another: {exciters} exciter"
            f"{'s' if exciters > 1 else ''} cannot separate them"
        )
    hidden = [k + 1 for k, d in enumerate(dips) if not d < SHARP]
    if hidden:
        said.append(
            f"mode {', '.join(map(str, hidden))}: no clear dip of the indicator with these "
            "exciters (1 % damping): it will not be seen as a mode by itself"
        )
    if not model.parameters:
        said.append(
            "the problem has no parameters: add [update] with parameters for the lines that tell "
            "most of them, and the accuracy that they need"
        )
    return said
