"""Problems of the repository as text that a test may change and put elsewhere."""

from __future__ import annotations

from pathlib import Path

from cvxupdate.spec import load_problem
from cvxupdate.spec.write import tables_of, to_toml


def written_whole(path: Path) -> str:
    """A problem file with nothing included and every path absolute."""
    return to_toml(tables_of(load_problem(path)))
