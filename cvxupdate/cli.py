"""The command line. Exit status: 0 done, 1 an error of cvxupdate itself, 2 bad input, 3 infeasible
or not converged, 130 interrupted."""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import cvxupdate
from cvxupdate.commands.line import add
from cvxupdate.commands.shared import (
    Jobs,
    Json,
    Out,
    Problem,
    Recorded,
    Refitting,
    Scheduler,
    Thorough,
    display,
    say,
    warn,
)
from cvxupdate.errors import CvxupdateError, InfeasibleError, InputError
from cvxupdate.parallel import Where
from cvxupdate.report.files import folder_for, must_be_writable, write_files

if TYPE_CHECKING:
    from cvxupdate.update.trust_region import Iteration

os.environ.setdefault(
    "OPENBLAS_NUM_THREADS",
    "1",
    # read when numpy loads, on use: matrices are small here, and threads waiting for each other
    # cost more
)
app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # brackets in the help are those of TOML
    help="Update structural dynamics models by convex programs, and say what physics they leave "
    "out.",
)
OWN_FAULT, BAD_INPUT, NOT_DONE, INTERRUPTED = 1, 2, 3, 130
DEBUG = "CVXUPDATE_DEBUG"
"""Environment variable that lets the traceback of an error inside cvxupdate through."""
STOPPED = "interrupted; what was finished is kept."


def _version(asked: bool) -> None:
    if asked:
        print(f"cvxupdate {cvxupdate.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="print the version"),
    ] = False,
) -> None:
    pass


@app.command()
def run(
    problem: Problem,
    out: Out = None,
    as_json: Json = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Update the model of a problem file."""
    from cvxupdate.report import run_files, run_summary
    from cvxupdate.spec import name_of
    from cvxupdate.study import run as do

    must_be_writable(out)
    folder = folder_for(out, name_of(problem), "run")
    with display(as_json) as show:
        reading = None if show is None else show.read
        said = None if show is None else lambda h: show.say(_iteration(h))
        where = Where(jobs, scheduler)
        updated = do(problem, said, reading, warn, where, folder / "starts.jsonl")
    files, payload = run_files(updated, folder)
    write_files(folder, files, ("updated/problem.toml",))
    say(payload, as_json, lambda: run_summary(updated, folder))
    if updated.status not in ("converged", "optimal"):
        raise typer.Exit(NOT_DONE)


@app.command()
def correlate(problem: Problem, out: Out = None, as_json: Json = False) -> None:
    """Compare model and recordings; change nothing."""
    from cvxupdate.report import correlate_files, correlate_summary
    from cvxupdate.study import correlate as do

    must_be_writable(out)
    with display(as_json) as show:
        compared = do(problem, None if show is None else show.read, warn)
    files, payload = correlate_files(compared)
    folder = folder_for(out, compared.problem, "correlate")
    write_files(folder, files)
    say(payload, as_json, lambda: correlate_summary(compared, folder))


@app.command()
def diagnose(
    problem: Problem,
    out: Out = None,
    as_json: Json = False,
    thorough: Thorough = False,
    jobs: Refitting = None,
) -> None:
    """Locate the mismatch, name the physics left out, model it, and show the fit improve."""
    from cvxupdate.report.diagnosis import diagnosis_files, diagnosis_summary
    from cvxupdate.spec import load_problem
    from cvxupdate.study import diagnose as do

    must_be_writable(out)
    with display(as_json) as show:
        said, reading = (None, None) if show is None else (show.say, show.read)
        found = do(problem, said, reading, warn, thorough, jobs)
    folder = folder_for(out, found.problem, "diagnose")
    files, payload = diagnosis_files(found, load_problem(problem), folder)
    write_files(folder, files, ("updated/problem.toml", "updated/refined.toml"))
    say(payload, as_json, lambda: diagnosis_summary(found, folder))


@app.command()
def solvers(problem: Problem, out: Out = None, as_json: Json = False) -> None:
    """Solve the same step with every installed solver and compare."""
    from cvxupdate.report import solvers_files, solvers_summary
    from cvxupdate.study import solvers as do

    must_be_writable(out)
    spec, rows, spread = do(problem)
    files, payload = solvers_files(spec.name, spec.title, rows, spread)
    folder = folder_for(out, spec.name, "solvers")
    write_files(folder, files)
    say(payload, as_json, lambda: solvers_summary(spec.name, rows, spread, folder))
    if not any(r.status == "optimal" for r in rows):
        raise typer.Exit(NOT_DONE)


@app.command()
def check(problem: Problem, as_json: Json = False) -> None:
    """Validate a problem file and everything it names; say every fault with file, key and
    remedy."""
    from cvxupdate.errors import ProblemFileError
    from cvxupdate.report.as_json import dumps, plain
    from cvxupdate.report.checked import check_lines
    from cvxupdate.study import check as do

    faults, summary = [], {}
    try:
        summary = do(problem)
    except ProblemFileError as error:
        faults = [vars(f) for f in error.faults]
        text = str(error)
    except InputError as error:
        faults, text = (
            [{"file": str(problem), "key": "", "problem": str(error), "remedy": ""}],
            str(error),
        )
    if as_json:
        print(
            dumps(plain({"problem": str(problem), "faults": faults, "warnings": [], **summary})),
            end="",
        )
    elif faults:
        print(text, file=sys.stderr)
    else:
        print("\n".join(check_lines(str(problem), summary)))
    if faults:
        raise typer.Exit(BAD_INPUT)


@app.command()
def inspect(file: Recorded, as_json: Json = False) -> None:
    """Say what a file of recordings holds: channels, levels, faults, spectral lines, and a
    [[recordings]] block to start from."""
    from cvxupdate.report import inspect_json
    from cvxupdate.study import inspect as do

    with display(as_json, "") as show:
        found = do(file, None if show is None else show.read)
    print(inspect_json(found) if as_json else found.text(), end="" if as_json else "\n")


@app.command()
def schema() -> None:
    """Print the JSON Schema of problem files."""
    from cvxupdate.spec import schema as do

    print(json.dumps(do(), indent=2, ensure_ascii=False))


add(app)


def _iteration(h: Iteration) -> str:
    return f"iteration {h.number}: objective {h.objective:.6g}, step {h.step:.2g}"


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(
                encoding="utf-8"
            )  # names and units are not ASCII, whatever the locale says
    # pages are drawn without a backend, and that of a notebook is unknown outside its kernel
    os.environ.pop("MPLBACKEND", None)
    try:
        given = app(standalone_mode=False)  # typer.Exit comes back as its number
    except InfeasibleError as error:
        code = _fail(str(error), NOT_DONE)
    except InputError as error:
        code = _fail(str(error), BAD_INPUT)
    except CvxupdateError as error:
        code = _fail(str(error), NOT_DONE)
    except (KeyboardInterrupt, typer.Abort):
        code = _fail(STOPPED, INTERRUPTED)
    except BrokenPipeError:
        code = 0
    except Exception as error:
        message = getattr(error, "format_message", None)
        if type(error).__module__.startswith(("click", "typer")) and callable(message):
            said = message()  # empty when the help was printed for lack of a command
            code = _fail(f"{said} Try '{_helped()} --help'.", BAD_INPUT) if said else BAD_INPUT
        elif os.environ.get(DEBUG):
            raise
        else:
            code = _fail(_own_fault(error), OWN_FAULT)
    else:
        code = given if isinstance(given, int) else 0
        if code == INTERRUPTED:  # typer turns Ctrl-C into this number without a word
            _fail(STOPPED, code)
    sys.exit(code)


def _helped() -> str:
    """The command whose help says more."""
    command = sys.argv[1] if len(sys.argv) > 1 else ""
    return f"cvxupdate {command}" if command in _commands() else "cvxupdate"


def _commands() -> set[str]:
    found = app.registered_commands
    return {str(c.name or getattr(c.callback, "__name__", "")) for c in found}


def _own_fault(error: Exception) -> str:
    """One line for an error that should not have happened: what, where in the package, what to
    do."""
    place, step = "", error.__traceback__
    while step is not None:
        file = Path(step.tb_frame.f_code.co_filename)
        if file.is_relative_to(Path(__file__).parent):
            place = f" ({file.relative_to(Path(__file__).parents[1])}, line {step.tb_lineno})"
        step = step.tb_next
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return (
        f"an error of cvxupdate itself, not of your files: {what}{place}. Nothing was written. "
        f"Please report it; with {DEBUG}=1 it says more."
    )


def _fail(message: str, code: int) -> int:
    print(f"cvxupdate: {message}", file=sys.stderr)
    return code
