"""The wiring: problem file in, result out. The one file that knows every part."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cvxupdate.parallel import Where
from cvxupdate.spec import Given, Spec, spec_of
from cvxupdate.spec.given import to_update

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.correlate.plausible import Warn
    from cvxupdate.correlate.result import Compared
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.inspect import Inspection
    from cvxupdate.recordings.read.contents import Progress
    from cvxupdate.recordings.types import Recording
    from cvxupdate.update.result import Updated
    from cvxupdate.update.starts import Solve
    from cvxupdate.update.trust_region import Iteration


def open_problem(
    problem: Given, progress: Progress | None = None, finer: bool = True
) -> tuple[Spec, Model, tuple[Recording, ...]]:
    """A problem file with its model and recordings; ``progress`` hears (what, done, total) of
    large files that are read; ``finer``: the model on the parts that [model] ``refine`` asks for.

    Raises
    ------
    InputError
        For any fault of the file, the model or a recording.
    """
    from cvxupdate.fe.analysis import as_stated

    spec = _read(problem)
    model, recordings = _parts(spec, progress)
    return spec, as_stated(spec, model) if finer else model, recordings


def _read(problem: Given) -> Spec:
    """A problem file with what moves the structure in place, so that a motion that is imposed is an
    input like a force to all that follows."""
    from cvxupdate.fe.build import on_its_bases

    return on_its_bases(spec_of(problem))


def _parts(spec: Spec, progress: Progress | None = None) -> tuple[Model, tuple[Recording, ...]]:
    from cvxupdate.fe.build import build_model
    from cvxupdate.recordings.load import load_recordings

    return build_model(spec), load_recordings(spec, progress)


def _one_state(
    spec: Spec, progress: Progress | None = None
) -> tuple[Spec, Model, tuple[Recording, ...]]:
    """A problem without the recordings of the reference state, where there are others: a model has
    one state; and without correlations where its method takes deviations alone."""
    from cvxupdate.recordings.states import looked_into
    from cvxupdate.recordings.uncorrelated import METHODS, uncorrelated

    model, recordings = _parts(spec, progress)
    now, kept = looked_into(spec, recordings)
    alone = now.update is not None and now.update.method not in METHODS
    return now, model, uncorrelated(kept) if alone else kept


def read_recordings(problem: Given) -> tuple[Recording, ...]:
    """The recordings of a problem whose model is not asked for; raises `InputError`."""
    from cvxupdate.recordings.load import load_recordings

    return load_recordings(_read(problem))


def run(
    problem: Given,
    progress: Callable[[Iteration], None] | None = None,
    reading: Progress | None = None,
    warn: Warn | None = None,
    where: Where | None = None,
    keep: Path | None = None,
) -> Updated:
    """Update the model of a problem file as its [update] table says; several starts run ``where``
    (None: one process for each processor), kept in the file ``keep`` as they finish.

    Raises
    ------
    InputError
        For a fault of the input; an infeasible step is a result, ``status`` "infeasible".
    """
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.correlate.overlay import frf_overlays
    from cvxupdate.correlate.own_errors import own_errors
    from cvxupdate.correlate.plausible import examine
    from cvxupdate.update.ceam import update_ceam
    from cvxupdate.update.definite import definiteness
    from cvxupdate.update.direct import update_direct
    from cvxupdate.update.grouping import grouped
    from cvxupdate.update.judgement import judgement
    from cvxupdate.update.modal import update_modal
    from cvxupdate.update.modal_dynamic import update_modal_dynamic
    from cvxupdate.update.refine import refined_for
    from cvxupdate.update.rfm import update_rfm
    from cvxupdate.update.score import caveats
    from cvxupdate.update.starts import Many
    from cvxupdate.written import updated_file

    spec, table = to_update(_read(problem), "run")
    spec, model, recordings = _one_state(spec, reading)
    warnings = examine(spec, model, recordings, warn)
    if table.method == "direct":
        refined_for(spec, model)  # says that it cannot
        return replace(update_direct(spec, model, recordings), warnings=warnings)
    spec, model, groupings = grouped(spec, model, recordings)
    model = refined_for(spec, model)
    others = {"ceam": update_ceam, "rfm": update_rfm, "modal-dynamic": update_modal_dynamic}
    if table.method in others:
        updated = others[table.method](spec, model, recordings, progress)
    else:
        many = Many(where, keep, partial(reading, "starts") if reading else None, open_start)
        updated = update_modal(spec, model, recordings, progress, many)
    p = [q.p for q in updated.parameters]
    return replace(
        updated,
        model={**updated.model, **definiteness(model, p)},
        recordings=own_errors(model, recordings, p, updated.modes),
        warnings=warnings,
        written=updated_file(spec, model, p) if updated.status != "infeasible" else None,
        caveats=caveats(updated, table.frequency_points != "all"),
        judgement=judgement(updated),
        groupings=groupings,
        geometry=geometry_of(spec, model) if groupings else None,
        overlays=frf_overlays(model, recordings, p, table.frequency_points),
    )


def open_start(problem: str) -> Solve:
    """What solves one of many starts of a problem file, for a process of its own."""
    from cvxupdate.update.grouping import grouped
    from cvxupdate.update.modal_fit import modal_fit
    from cvxupdate.update.refine import refined_for

    spec, model, recordings = _one_state(_read(problem))
    spec, model, _ = grouped(spec, model, recordings)
    model = refined_for(spec, model)
    return modal_fit(spec, model, recordings).solve


def correlate(
    problem: Given, progress: Progress | None = None, warn: Warn | None = None
) -> Compared:
    """Compare the model of a problem file with its recordings: modes, shapes, frequency responses,
    sensors. Nothing is changed.

    Raises
    ------
    InputError
        For a fault of the input, or where there is no recording to compare with.
    """
    from cvxupdate.beside import compared
    from cvxupdate.correlate.plausible import examine

    begin = time.perf_counter()
    opened = open_problem(problem, progress)
    found = compared(*opened, examine(*opened, warn))
    return replace(found, time=time.perf_counter() - begin)


def inspect(path: str | os.PathLike[str], progress: Progress | None = None) -> Inspection:
    """What a file of recordings holds, and a [[recordings]] block to start from.

    Raises
    ------
    RecordingError
        When it cannot be read.
    """
    from cvxupdate.recordings.inspect import inspect_file

    return inspect_file(Path(path), progress=progress)


def solvers(problem: Given) -> tuple[Spec, tuple[SolverRow, ...], float]:
    """The first convex step by every installed solver: (problem, rows, spread of objectives).

    Raises
    ------
    InputError
        For a fault of the input.
    """
    from cvxupdate.convex import compare_solvers, spread
    from cvxupdate.update.first import first_system
    from cvxupdate.update.grouping import grouped
    from cvxupdate.update.parts import solver_choice, step_problem
    from cvxupdate.update.refine import refined_for

    spec, model, recordings = _one_state(to_update(_read(problem), "solvers")[0])
    spec, model, _ = grouped(spec, model, recordings)
    model = refined_for(spec, model)
    system, _ = first_system(spec, model, recordings)
    rows = compare_solvers(step_problem(spec, model, recordings), system, None, solver_choice(spec))
    return spec, rows, spread(rows) if any(r.status == "optimal" for r in rows) else float("nan")


def check(problem: Given) -> dict[str, object]:
    """Validate a problem file, build its model and read its recordings: counts of what was found,
    its mass, extent and first natural frequencies, what is ``held``, ``moved`` and ``free``, the
    recordings of each of its ``states``, what was ``recorded``, and ``warnings`` of what is
    probably a mistake.

    Raises `InputError` with every fault at once, as far as they can be found.
    """
    from cvxupdate.correlate.plausible import (
        examine,
        facts,
        held,
        input_doubts,
        moved,
        recorded,
        states,
    )
    from cvxupdate.physics.known import refuse_unknown

    spec, model, recordings = open_problem(problem)
    refuse_unknown(spec)
    return {
        "nodes": len(model.node_ids),
        "elements": len({int(i) for b in model.blocks if not b.is_base for i in b.ids}),
        "free DOFs": model.size,
        "recordings": len(recordings),
        "parameters": len(model.parameters),
        "held": held(spec),
        "moved": moved(spec),
        "states": states(spec),
        "recorded": recorded(recordings, spec.model.bases),
        **facts(model),  # a mechanism or an indefinite mass shows here
        "warnings": [
            asdict(d) for d in (*examine(spec, model, recordings), *input_doubts(model, recordings))
        ],
    }


def diagnose(
    problem: Given,
    progress: Callable[[str], None] | None = None,
    reading: Progress | None = None,
    warn: Warn | None = None,
    thorough: bool = False,
    jobs: int | None = None,
) -> Diagnosis:
    """Locate the mismatch, name the missing physics, model it. ``thorough``: however long it takes;
    ``jobs`` processes refit (None: one for each processor).

    Raises
    ------
    InputError
        For a fault of the input, or when there is no recording to fit.
    """
    from cvxupdate.beside import beside, compared, reopened
    from cvxupdate.correlate.plausible import examine
    from cvxupdate.diagnose import diagnose_problem
    from cvxupdate.errors import CvxupdateError
    from cvxupdate.fe.analysis import as_stated
    from cvxupdate.physics.known import refuse_unknown
    from cvxupdate.recordings.load import load_recordings
    from cvxupdate.recordings.uncorrelated import uncorrelated
    from cvxupdate.written import with_refined

    spec, file, recordings = open_problem(problem, reading, finer=False)
    model = as_stated(spec, file)
    recordings = uncorrelated(recordings)
    refuse_unknown(spec)
    warnings = examine(spec, model, recordings, warn, meshed=False)
    found = diagnose_problem(spec, file, recordings, progress, thorough, jobs)
    known = tuple(zip(spec.recordings, recordings, strict=True))

    def again(other: Spec, changed: Model) -> Compared:  # nothing is read a second time
        return compared(other, changed, load_recordings(other, known=known))

    try:
        after = reopened(spec, found)
    except CvxupdateError:
        after = None
    return replace(
        with_refined(found, spec, after, again),
        warnings=warnings,
        beside=beside(spec, model, recordings, found, after),
    )
