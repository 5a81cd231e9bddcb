"""What the commands share: their common arguments, what they print where."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

NOTEBOOK = "JPY_PARENT_PID"
"""Set by the kernel of a notebook, and so in every command that a cell starts."""
if TYPE_CHECKING:
    from cvxupdate.report.terminal import Display

Problem = Annotated[
    Path, typer.Argument(metavar="PROBLEM", help="a problem file (TOML)", show_default=False)
]
Recorded = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="a file of recordings (UFF, MAT, HDF5, NPZ, CSV or text)",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        help="folder for results; default out/<name of the problem>/<command>",
        show_default=False,
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        min=1,
        help="processes for several starts; default one for each processor",
        show_default=False,
    ),
]
Refitting = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        min=1,
        help="processes that refit; default one for each processor; the same answer where time "
        "does not end the search",
        show_default=False,
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="dask cluster for several starts, in place of processes, e.g. tcp://10.0.0.1:8786",
        show_default=False,
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="print the JSON on standard output and nothing else there")
]
Thorough = Annotated[
    bool,
    typer.Option("--thorough", help="search to the end, however long it takes"),
]


def warn(says: str) -> None:
    """A probable mistake, on standard error before the work begins."""
    print(f"Warning: {says}", file=sys.stderr, flush=True)


def say(payload: str, as_json: bool, summary: Callable[[], Any]) -> None:
    """The JSON, or the summary, on standard output."""
    if as_json:
        print(payload)
        return
    from rich.console import Console

    Console().print(summary(), crop=False)  # a long path stays in one piece


@contextlib.contextmanager
def display(quiet: bool, first: str = "reading the recordings") -> Iterator[Display | None]:
    """Bar and line on standard error, so that standard output stays the result; none with --json or
    without a terminal. A cell of a notebook is none, though it passes for one: it would keep every
    frame."""
    if quiet or not sys.stderr.isatty() or NOTEBOOK in os.environ:
        yield None
        return
    from rich.console import Console

    from cvxupdate.report.terminal import Display

    shown = Display(Console(stderr=True))
    if first:
        shown.say(first)
    try:
        yield shown
    finally:
        shown.close()
