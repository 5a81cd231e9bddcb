"""`plan`: what to measure, from the model alone; or to tell the explanations of a diagnosis
apart."""

from __future__ import annotations

import time
from collections.abc import Callable
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
from cvxupdate.commands.planned import Diagnosed, ExciterSet, Options, Planned
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes

if TYPE_CHECKING:
    from cvxupdate.diagnose.apart import Apart
    from cvxupdate.spec.given import Given

MORE = 1.5
"""Sensors for each mode where nothing is asked for: some to spare for a broken channel."""
SHARP = 0.3
"""MMIF below which a mode is shown by its dip."""


def plan(
    given: Given,
    options: Options | None = None,
    diagnosis: Diagnosed | None = None,
    progress: Callable[[str], None] | None = None,
) -> Planned:
    """Sensors, exciters, frequency lines and the accuracy needed for the model and the parameters
    of a problem, in any of its forms. Its recordings, if it has any, are not read; with a
    ``diagnosis`` they are, and what would tell its explanations apart is planned as well.

    Raises
    ------
    InputError
        For a fault of the file, a request that the model cannot meet, or a diagnosis that leaves
        nothing to tell apart.
    """
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.fe.build import build_model
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.spec import spec_of

    begin, o = time.perf_counter(), Options() if options is None else options
    spec = spec_of(given)
    model = build_model(spec)
    apart = None if diagnosis is None else _apart(given, diagnosis, o, progress)
    modes = model_modes(model, o.modes).flexible()
    if not len(modes.eigenvalues):
        raise InputError(f"{spec.path}: the model has no mode that is not rigid.")
    mass = np.asarray(model.matrices().M.diagonal())
    places = candidates(model)
    wanted = o.sensors or min(int(np.ceil(MORE * len(modes.eigenvalues))), len(places))
    first = sensor_sets(model, modes, mass, wanted, None)[0].labels
    exciters = exciter_set(model, modes, o.exciters, first)
    told = information(model, modes.frequencies, exciters.labels, o)
    sensors = sensor_sets(model, modes, mass, wanted, told)
    exciters = exciter_set(model, modes, len(exciters.labels), sensors[0].labels)
    notes = _short(model, places, modes, told is None, o)
    lines, log, said = line_sets(model, modes.frequencies, sensors[0].labels, exciters.labels, o)
    shown = indicator(model, modes, sensors[0].labels, exciters.labels)
    notes += _said(model, exciters, shown.dips, modes.frequencies)
    return Planned(
        spec.name,
        spec.title,
        spec.shown,
        time.perf_counter() - begin,
        o.line() if diagnosis is None else f"{o.line()} --diagnosis {diagnosis.name}".strip(),
        tuple(modes.frequencies.tolist()),
        sensors,
        exciters,
        shown,
        tuple(q.name for q in model.parameters),
        lines,
        log,
        o.usual,
        o.accuracy,
        (*notes, *said),
        geometry_of(spec, model),
        apart,
    )


def _short(
    model: Model, places: np.ndarray, modes: Modes, silent: bool, options: Options
) -> list[str]:
    """What a plan cannot do that was asked; ``silent``: nothing is known of what sensors tell."""
    notes = []
    if len(modes.eigenvalues) < options.modes:
        notes.append(f"the model has {len(modes.eigenvalues)} modes that are not rigid")
    if model.parameters and silent:
        notes.append(
            f"sensors are not chosen by what they tell of the parameters: {len(places)} free "
            f"translations are more than {MOST_PLACES}"
        )
    return notes


def _apart(
    given: Given,
    diagnosis: Diagnosed,
    options: Options,
    progress: Callable[[str], None] | None,
) -> Apart:
    from cvxupdate.diagnose.apart import told_apart
    from cvxupdate.study import open_problem

    spec, model, recordings = open_problem(given, finer=False)
    where, tell = diagnosis.where, progress or (lambda text: None)
    told = diagnosis.content
    return told_apart(
        spec, model, recordings, told, where, options.noise, options.band, tell, options.further
    )


def _said(
    model: Model, found: ExciterSet, dips: tuple[float, ...], frequencies: np.ndarray
) -> list[str]:
    said, drive, exciters = [], found.drive, len(found.labels)
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
