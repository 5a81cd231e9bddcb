"""The commands as functions: `run`, `update`, `correlate`, `diagnose`, `check`, `inspect`,
`solvers`.

Each takes a problem in any form: the path of a problem file, TOML text, its tables as a dictionary,
a `Problem`, or a `Model` with recordings.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cvxupdate import study
from cvxupdate.api.inspected import Inspected
from cvxupdate.api.problem import given_problem, listed, parameter_rows
from cvxupdate.api.results import CorrelateResult, DiagnoseResult, UpdateResult
from cvxupdate.errors import InputError, ProblemWarning
from cvxupdate.parallel import Where
from cvxupdate.registry import EFFECTS
from cvxupdate.spec import Spec

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.update.result import Updated

Tell = Callable[[str], None]


def run(
    problem: Any,
    recordings: Any = None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: bool | Tell = False,
    **tables: Any,
) -> UpdateResult:
    """Update the model of a problem as its [update] table says.

    ``jobs`` processes for several starts (None: one for each processor), or the dask cluster at the
    address ``scheduler``; ``progress`` is True for lines on standard error, or what hears each;
    ``tables`` replace those of the problem: ``update = {...}``, ``solver = {"name": "SCS"}``.

    Raises
    ------
    InputError
        For a fault of the input; an infeasible step is a result, ``status`` "infeasible".
    """
    spec, keep = given_problem(problem, recordings, **tables)
    tell = _teller(progress)
    said = None if tell is None else (lambda h: tell(f"iteration {h.number}: {h.objective:.6g}"))
    return UpdateResult(study.run(spec, said, None, _warn, Where(jobs, scheduler)), spec, keep)


def update(
    model: Any,
    recordings: Any,
    parameters: Any,
    *,
    method: str | None = None,
    constraints: Any = (),
    regularisers: Any = (),
    loss: Any = None,
    solver: str | Mapping[str, Any] | None = None,
    progress: bool | Tell = False,
    **settings: Any,
) -> UpdateResult:
    """Update a model by recordings.

    Parameters
    ----------
    model : a `Model`.
    recordings : `Frf`, `TimeHistory`, `Modes` or tables of [[recordings]]; one, or a list.
    parameters : what may change: rows of [update] parameters ({"group": "column", "of": "E"}), or
        in words: ``"column: E"``, ``"all: stiffness"``.
    method : frequencies, sensitivity, rfm or ceam; None: rfm for responses, sensitivity for modes
        with shapes, else frequencies.
    constraints : tables ({"bounds": {"lower": -0.5}}) or objects with ``clauses(columns)``.
    regularisers : tables ({"kind": "l1", "weight": 0.1}) or objects.
    loss : a name, or an object.
    settings : further keys of [update].

    Raises
    ------
    InputError
        For a fault of the input.
    """
    given = listed(recordings)
    table = {
        **({} if method is None else {"method": method}),
        "parameters": parameter_rows(parameters),
        **({"loss": loss} if isinstance(loss, str) else {}),
        **settings,
    }
    spec, keep = given_problem(
        model,
        given,
        update=table,
        constraints=constraints,
        regularisers=regularisers,
        loss=None if isinstance(loss, str) else loss,
        solver={"name": solver} if isinstance(solver, str) else solver,
    )
    tell = _teller(progress)
    said = None if tell is None else (lambda h: tell(f"iteration {h.number}: {h.objective:.6g}"))
    return UpdateResult(study.run(spec, said, None, _warn), spec, keep)


def correlate(problem: Any, recordings: Any = None) -> CorrelateResult:
    """Compare a model with recordings: modes, shapes, frequency responses, sensors. Nothing is
    changed.

    Raises
    ------
    InputError
        For a fault of the input, or where there is no recording to compare with.
    """
    spec, keep = given_problem(problem, recordings)
    return CorrelateResult(study.correlate(spec, None, _warn), spec, keep)


def diagnose(
    problem: Any,
    recordings: Any = None,
    *,
    physics: Sequence[Any] | None = None,
    scatter: float | None = None,
    progress: bool | Tell = False,
    jobs: int | None = None,
) -> DiagnoseResult:
    """Locate the mismatch, name the physics that the model leaves out, model it, and show how the
    fit to held-out recordings improves.

    ``physics`` are the effects that may be considered (None: everything that the recordings can
    tell), by name; objects among them are effects of the program's own, tried beside the package's.
    ``scatter`` is the part of the usual scatter of groups that remains. ``jobs`` processes refit
    (None: one for each processor; in a notebook, and in a program with threads of its own, this one
    alone); the answer is the same where time does not end the search.

    Raises
    ------
    InputError
        For a fault of the input, or when there is no recording to fit.
    """
    names, own = _effects(physics)
    asked = {k: v for k, v in (("physics", names), ("scatter", scatter)) if v is not None}
    spec, keep = given_problem(problem, recordings, diagnose=asked or None)
    with _registered(own):
        found = study.diagnose(spec, _teller(progress), None, _warn, jobs=jobs)
        return DiagnoseResult(found, spec, keep)


def _effects(physics: Any) -> tuple[list[str] | None, tuple[Any, ...]]:
    """Names to consider (None: all), and effects of the program's own."""
    if physics is None:
        return None, ()
    given = [physics] if isinstance(physics, str) or not isinstance(physics, Sequence) else physics
    own = tuple(e for e in given if not isinstance(e, str))
    for one in own:
        if isinstance(one, type) or not callable(getattr(one, "candidates", None)):
            raise InputError(
                f"physics: {one!r} is no effect. Give names, or objects of a class that satisfies "
                "cvxupdate.physics.EffectType."
            )
    names = [e for e in given if isinstance(e, str)]
    return (names or None), own


@contextmanager
def _registered(own: Sequence[Any]) -> Iterator[None]:
    done: list[Any] = []
    try:
        for effect in own:
            done.append(EFFECTS.register(effect))
        yield
    finally:
        for effect in done:
            EFFECTS.unregister(effect)


def check(problem: Any, recordings: Any = None) -> dict[str, object]:
    """Validate a problem, build its model and read its recordings: counts of what was found, mass,
    extent and first natural frequencies, what is ``held`` and what moves ``free``, and
    ``warnings`` of what is probably a mistake.

    Raises
    ------
    ProblemFileError
        With every fault at once, as far as they can be found.
    """
    spec, _ = given_problem(problem, recordings)
    return study.check(spec)


def inspect(file: str | os.PathLike[str]) -> Inspected:
    """What a file of recordings holds, and a [[recordings]] block to start from.

    Raises
    ------
    RecordingError
        When it cannot be read.
    """
    if not isinstance(file, str | os.PathLike):
        raise InputError(f"inspect: a {type(file).__name__} is no file. Give a path.")
    return Inspected(study.inspect(file))


def solvers(problem: Any, recordings: Any = None) -> tuple[Spec, tuple[SolverRow, ...], float]:
    """The first convex step by every installed solver: (problem, rows, spread of objectives).

    Raises
    ------
    InputError
        For a fault of the input.
    """
    spec, _ = given_problem(problem, recordings)
    return study.solvers(spec)


def run_files(
    updated: UpdateResult | Updated, folder: str | os.PathLike[str] = "."
) -> tuple[dict[str, str], str]:
    """The files of `run` as texts by name, as they are to lie in ``folder``, and the JSON by
    itself; `UpdateResult.save` writes them."""
    from cvxupdate.report import run_files as texts

    data = updated.data if isinstance(updated, UpdateResult) else updated
    return texts(data, Path(folder))


def _teller(progress: bool | Tell) -> Tell | None:
    if callable(progress):
        return progress
    return (lambda text: print(text, file=sys.stderr, flush=True)) if progress else None


def _warn(says: str) -> None:
    warnings.warn(says, ProblemWarning, stacklevel=4)
