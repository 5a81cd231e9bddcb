"""Results for people and programs: JSON, one self-contained HTML page, a short summary. Plotting
and templates load on first use."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cvxupdate.convex import SolverRow
    from cvxupdate.correlate.result import Compared
    from cvxupdate.recordings.inspect import Inspection
    from cvxupdate.update.result import Updated

__all__ = [
    "correlate_files",
    "correlate_summary",
    "inspect_json",
    "run_files",
    "run_summary",
    "solvers_files",
    "solvers_summary",
]


def correlate_files(compared: Compared) -> tuple[dict[str, str], str]:
    """The files of `correlate`, {"result.json": text, "report.html": text}, and the JSON text by
    itself."""
    from cvxupdate.report.as_json import correlate_data, dumps
    from cvxupdate.report.correlate_page import correlate_page

    text = dumps(correlate_data(compared))
    return {"result.json": text, "report.html": correlate_page(compared)}, text


def correlate_summary(compared: Compared, folder: Path) -> RenderableType:
    """What `correlate` prints on a terminal: the verdict, the pairs, and where the files lie."""
    from cvxupdate.report.summary import correlate_text

    return correlate_text(compared, folder)


def inspect_json(found: Inspection) -> str:
    """What `inspect` found in a file, as JSON text."""
    from dataclasses import asdict

    from cvxupdate.report.as_json import dumps, plain

    return dumps(plain(asdict(found)))


def run_files(updated: Updated, folder: Path = Path()) -> tuple[dict[str, str], str]:
    """The files of `run`, {"result.json": text, "report.html": text, "updated/problem.toml": text}
    (the last one where the updated model can be written as a problem file, of a direct method with
    its matrices beside it), and the JSON text by itself; ``folder`` is where they will lie."""
    from cvxupdate.report.as_json import dumps, run_data
    from cvxupdate.report.run_page import run_page

    text = dumps(run_data(updated))
    files = {"result.json": text, "report.html": run_page(updated)}
    if updated.written is not None:
        files["updated/problem.toml"] = updated.written.text_in(folder / "updated")
        files |= {f"updated/{name}": matrix for name, matrix in updated.matrix_files.items()}
    return files, text


def run_summary(updated: Updated, folder: Path) -> RenderableType:
    """What `run` prints on a terminal: the verdict, the fit, the parameters, and where the files
    lie."""
    from cvxupdate.report.summary import run_text

    return run_text(updated, folder)


def solvers_files(
    name: str, title: str, rows: Sequence[SolverRow], spread: float
) -> tuple[dict[str, str], str]:
    """The files of `solvers`, {"result.json": text, "report.html": text}, and the JSON text by
    itself.

    ``spread`` is the largest relative difference between the objectives of the solvers that reached
    the optimum, NaN when none did.
    """
    from cvxupdate.report.as_json import dumps, solvers_data
    from cvxupdate.report.solvers_page import solvers_page

    text = dumps(solvers_data(name, title, rows, spread))
    return {"result.json": text, "report.html": solvers_page(name, title, rows, spread)}, text


def solvers_summary(
    name: str, rows: Sequence[SolverRow], spread: float, folder: Path
) -> RenderableType:
    """What `solvers` prints on a terminal: a row for each solver, how far the objectives agree, and
    where the files lie."""
    from cvxupdate.report.summary import solvers_text

    return solvers_text(name, rows, spread, folder)
