"""The wiring: problem file in, result out. The one file that knows every part."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cvxupdate.errors import CvxupdateError, InputError
from cvxupdate.spec import Spec, load_problem

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.correlate.result import Compared
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.inspect import Inspection
    from cvxupdate.recordings.load import Known
    from cvxupdate.recordings.read.contents import Progress
    from cvxupdate.recordings.types import Recording
    from cvxupdate.update.result import Updated
    from cvxupdate.update.trust_region import Iteration

MODES_IN_BAND = 30
"""Modes computed for the sensors of frequency responses."""
MESH_MATTERS, NEARER = 1e-3, 0.7
"""Relative shift of the frequencies by the mesh above which a finer one is tried, and the fraction
to which it must reduce the error."""
WORTH = {"frf_error": 0.01, "response_error": 0.01, "frequency_error_percent_mean": 0.1}
"""The least absolute reduction of the error, by metric."""
UNITS = {
    "frf_error": " of the frequency responses",
    "response_error": " of the time responses",
    "frequency_error_percent_mean": " % of the frequencies",
}


def open_problem(
    path: str | os.PathLike[str], progress: Progress | None = None
) -> tuple[Spec, Model, tuple[Recording, ...]]:
    """A problem file with its model and recordings; ``progress`` is called while
    large files are read, with (what, done, total).

    Raises
    ------
    InputError
        For any fault of the file, the model or a recording (`ProblemFileError`, `ModelError`,
        `RecordingError`).
    """
    from cvxupdate.fe.build import build_model
    from cvxupdate.recordings.load import load_recordings

    spec = load_problem(Path(path))
    return spec, build_model(spec), load_recordings(spec, progress)


def run(
    path: str | os.PathLike[str],
    progress: Callable[[Iteration], None] | None = None,
    reading: Progress | None = None,
) -> Updated:
    """Update the model of a problem file as its [update] table says.

    Raises
    ------
    InputError
        For a fault of the input; an infeasible step is no error but a result with ``status``
        "infeasible".
    """
    from cvxupdate.update.definite import definiteness
    from cvxupdate.update.modal import update_modal
    from cvxupdate.update.refine import refined_for

    spec, model, recordings = open_problem(path, reading)
    if spec.update is None:
        raise InputError(
            f"{path}: no [update] table, so there is nothing to run. Add one with a method and "
            "parameters."
        )
    model = refined_for(spec, model)
    if spec.update.method == "ceam":
        from cvxupdate.update.ceam import update_ceam

        updated = update_ceam(spec, model, recordings, progress)
    elif spec.update.method == "rfm":
        from cvxupdate.update.rfm import update_rfm

        updated = update_rfm(spec, model, recordings, progress)
    else:
        updated = update_modal(spec, model, recordings, progress)
    eigenvalues = definiteness(model, [q.p for q in updated.parameters])
    return replace(
        updated,
        model={**updated.model, **eigenvalues},
        notes=(*updated.notes, *quality_notes(recordings)),
    )


def correlate(path: str | os.PathLike[str], progress: Progress | None = None) -> Compared:
    """Compare the model of a problem file with its recordings: modes, shapes, frequency responses,
    sensors. Nothing is changed.

    Raises
    ------
    InputError
        For a fault of the input, or where there is no recording to compare with.
    """
    begin = time.perf_counter()
    compared = _compared(*open_problem(path, progress))
    return replace(compared, time=time.perf_counter() - begin)


def _compared(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Compared:
    """`correlate`, of a problem that was opened."""
    from cvxupdate.correlate.compare import compare
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.recordings.types import ModeTable
    from cvxupdate.residual.pairing import needed_modes, start_pairing
    from cvxupdate.residual.shape_rows import real_shapes

    if not recordings:
        raise InputError(
            f"{spec.path}: no recording to compare the model with. Add a [[recordings]] table."
        )
    found = sorted(
        ((k, r) for k, r in enumerate(recordings) if isinstance(r, ModeTable)),
        key=lambda item: item[1].origin.use != "fit",
    )
    which, tables = [k for k, _ in found], [r for _, r in found]
    modes = model_modes(
        model, max(needed_modes(tables), 0 if len(tables) == len(recordings) else MODES_IN_BAND)
    )
    fitted = sum(t.origin.use == "fit" for t in tables)
    start = start_pairing(
        model, modes, tables, spec.update.pairing if spec.update is not None else "auto", fitted
    )
    shapes = {
        k: None if t.shapes is None else real_shapes(t.shapes)
        for k, t in zip(which, tables, strict=True)
    }
    return compare(
        spec,
        model,
        recordings,
        modes,
        dict(zip(which, start.places, strict=True)),
        shapes,
        quality_notes(recordings),
    )


def inspect(path: str | os.PathLike[str], progress: Progress | None = None) -> Inspection:
    """What a file of recordings holds, and a [[recordings]] block to start from.

    Raises
    ------
    RecordingError
        When it cannot be read.
    """
    from cvxupdate.recordings.inspect import inspect_file

    return inspect_file(Path(path), progress=progress)


def quality_notes(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """What the quality checks say of the recordings, one sentence each, with the recording's
    name."""
    from cvxupdate.recordings.quality import check

    found = [
        f"Quality of {r.origin.name}: {finding.says}" for r in recordings for finding in check(r)
    ]
    return tuple(dict.fromkeys(found))


def solvers(path: str | os.PathLike[str]) -> tuple[Spec, tuple[SolverRow, ...], float]:
    """Solve the first convex step of a problem with every installed solver: (problem, a row for
    each, relative spread of the objectives).

    Raises
    ------
    InputError
        For a fault of the input.
    """
    from cvxupdate.convex import compare_solvers, spread
    from cvxupdate.update.modal import residual_of
    from cvxupdate.update.parts import solver_choice, step_problem

    spec, model, recordings = open_problem(path)
    if spec.update is not None and spec.update.method == "ceam":
        from cvxupdate.update.ceam import residual_of as ceam_residual

        system = ceam_residual(spec, model, recordings).evaluate(model.zero()).system()
    elif spec.update is not None and spec.update.method == "rfm":
        from cvxupdate.residual.frf import FrfResidual
        from cvxupdate.update.rfm import prepare

        kind = "flexibility" if spec.update.residual == "auto" else spec.update.residual
        system = (
            FrfResidual(model, prepare(spec, model, recordings).chosen, kind)
            .evaluate(model.zero())
            .system()
        )
    elif spec.update is not None:
        system = residual_of(spec, model, recordings).evaluate(model.zero()).system()
    else:
        raise InputError(f"{path}: solvers needs an [update] table with a method and parameters.")
    rows = compare_solvers(step_problem(spec, model, recordings), system, None, solver_choice(spec))
    return spec, rows, spread(rows) if any(r.status == "optimal" for r in rows) else float("nan")


def check(path: str | os.PathLike[str]) -> dict[str, object]:
    """Validate a problem file, build its model and read its recordings; counts of what was found.

    Raises
    ------
    InputError
        With every fault at once, as far as they can be found.
    """
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.physics.known import refuse_unknown

    spec, model, recordings = open_problem(path)
    refuse_unknown(spec)
    model_modes(model, 1)  # a mechanism or an indefinite mass shows here
    return {
        "nodes": len(model.node_ids),
        "elements": len({int(i) for b in model.blocks for i in b.ids}),
        "free DOFs": model.size,
        "recordings": len(recordings),
        "parameters": len(model.parameters),
    }


def diagnose(
    path: str | os.PathLike[str],
    progress: Callable[[str], None] | None = None,
    reading: Progress | None = None,
) -> Diagnosis:
    """Locate the mismatch of a problem, name the missing physics, model it, and show how the fit
    to held-out recordings improves.

    Raises
    ------
    InputError
        For a fault of the input, or when there is no recording to fit.
    """
    from cvxupdate.diagnose import diagnose_problem
    from cvxupdate.physics.known import refuse_unknown

    spec, model, recordings = open_problem(path, reading)
    refuse_unknown(spec)
    found = diagnose_problem(spec, model, recordings, progress)
    known = tuple(zip(spec.recordings, recordings, strict=True))
    return _with_refined(found, spec, known)


def _with_refined(found: Diagnosis, spec: Spec, known: Known) -> Diagnosis:
    """With the updated model on a finer mesh where that comes closer to the recordings in
    `correlate`, and the figures of both. The ``known`` recordings are not read again."""
    from cvxupdate.diagnose.output.refine import finer, finer_file, shift
    from cvxupdate.fe.build import build_model
    from cvxupdate.recordings.load import load_recordings
    from cvxupdate.spec import read_text

    if found.updated is None:
        return found
    try:
        coarse = read_text(found.updated.text, spec.path)
        fine = finer(coarse)
        if fine is None:
            return found
        specs = [coarse, fine]
        models = [build_model(s) for s in specs]
        if shift(*models) < MESH_MATTERS:
            return found
        both = [
            _compared(s, m, load_recordings(s, known=known)).fit
            for s, m in zip(specs, models, strict=True)
        ]
    except CvxupdateError:
        return found
    key, where = ("hold_out", "held-out") if both[0]["hold_out"] else ("fit", "fitted")
    name = next(m for m in WORTH if m in both[0][key])
    errors = [b[key][name]["after"] for b in both]
    if errors[1] > min(NEARER * errors[0], errors[0] - WORTH[name]):
        return found
    unit = UNITS[name]
    says = (
        f"In correlate, updated/problem.toml has an error of {errors[0]:.3g}{unit} ({where} "
        "recordings), because it keeps the mesh of the file that was diagnosed; on a finer "
        f"mesh the same model has {errors[1]:.3g}{unit}: updated/refined.toml."
    )
    return replace(found, refined=finer_file(fine), evidence=(*found.evidence, says))
