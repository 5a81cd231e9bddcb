"""Templates to pages: one self-contained HTML file, everything that came from outside escaped."""

from __future__ import annotations

import contextlib
import datetime
import functools
import importlib.metadata
import platform
import shlex
from pathlib import Path
from typing import Any

import jinja2

from cvxupdate.report.numbers import typeset


@functools.cache
def environment() -> jinja2.Environment:
    """The templates of this package; a name that the context lacks is an error, not an empty
    place."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    made = jinja2.Environment(
        loader=loader,
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["typeset"] = typeset
    return made


def render(template: str, context: dict[str, Any]) -> str:
    """The page, with what every page says: version, Python, date (UTC)."""
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    common = {
        "version": version(),
        "python": platform.python_version(),
        "packages": packages(),
        "date": today,
    }
    return environment().get_template(template).render(common | context)


def version() -> str:
    """The installed version of cvxupdate."""
    try:
        return importlib.metadata.version("cvxupdate")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"


def packages() -> str:
    """The versions of what decides the numbers."""
    found = []
    for name in ("numpy", "scipy", "cvxpy", "clarabel"):
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


def command(verb: str, path: str) -> str:
    """The command line that does the same again, the path as seen from here where that is
    shorter."""
    given = Path(path)
    with contextlib.suppress(ValueError, OSError):
        given = given.resolve().relative_to(Path.cwd())
    return f"cvxupdate {verb} {shlex.quote(str(given))}"
