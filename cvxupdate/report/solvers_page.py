"""The page of `solvers`: one convex step, every solver, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from cvxupdate.report import figures
from cvxupdate.report.as_json import overall
from cvxupdate.report.numbers import NOTHING, number, power, seconds
from cvxupdate.report.page import render

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow


def solvers_page(name: str, title: str, rows: Sequence[SolverRow], spread: float) -> str:
    """The HTML text of a report on `solvers`."""
    svg = figures.solver_bars(rows)
    solved = sum(r.status == "optimal" for r in rows)
    return render(
        "solvers.html",
        {
            "name": name,
            "title": title,
            "status": overall(rows),
            "solved": solved,
            "spread": _small(spread) if solved else NOTHING,
            "agree": solved > 1 and spread <= 1e-6,
            "figure": Markup(svg) if svg else None,
            "rows": [_row(r) for r in rows],
        },
    )


def _row(row: SolverRow) -> dict[str, str]:
    c = row.certificate.as_dict()
    return {
        "solver": row.solver,
        "status": row.status,
        "note": row.note,
        "iterations": str(row.iterations) if row.iterations else NOTHING,
        "objective": f"{row.objective:.10g}" if row.objective == row.objective else NOTHING,
        "time": seconds(row.seconds) if row.seconds > 0 else NOTHING,
        **{key: _small(value) for key, value in c.items()},
    }


def _small(value: float | None) -> str:
    return (
        NOTHING
        if value is None or value != value
        else "0"
        if value == 0.0
        else power(value)
        if abs(value) < 1e-3
        else number(value, 3)
    )
