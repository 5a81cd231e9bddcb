"""The table of direct methods on the page of `run`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import NOTHING, fixed, number
from cvxupdate.report.words import INDEFINITE

if TYPE_CHECKING:
    from cvxupdate.update.result import DirectResult, Updated


def direct_rows(updated: Updated) -> list[dict[str, Any]]:
    """One row for each method, as text; none where the method was another."""
    return [_row(d, updated.method == f"direct: {d.name}") for d in updated.direct]


def _row(d: DirectResult, chosen: bool) -> dict[str, Any]:
    return {
        "title": f"{d.title} ({d.equations})",
        "changes": d.changes,
        "chosen": chosen,
        "why": d.why,
        "stiffness": number(d.stiffness_change, 3),
        "mass": number(d.mass_change, 3),
        "fit": fixed(d.fit_error),
        "held": fixed(d.hold_out_error),
        "new": NOTHING if d.new_entries is None else str(d.new_entries),
        "definite": _definite(d),
        "where": ", ".join(d.where),
        "spurious": NOTHING if d.spurious is None else str(d.spurious),
    }


def _definite(d: DirectResult) -> str:
    bad = [
        name
        for name, value in (("mass", d.mass_min), ("stiffness", d.stiffness_min))
        if value is not None and value < -INDEFINITE
    ]
    return f"no: {' and '.join(bad)}" if bad else "yes"
