"""The table of direct methods on the page of `run`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from cvxupdate.report.numbers import NOTHING, fixed, number
from cvxupdate.report.structure import drawable
from cvxupdate.report.structure_places import place_map
from cvxupdate.report.words import INDEFINITE

if TYPE_CHECKING:
    from cvxupdate.update.result import DirectResult, Updated

CONVEX = "convex"
"""Name of the row of the constrained convex update."""
NAMED = 3
"""Nodes that carry their number in the figures."""
COMPARED = (
    ("changes", "What it may change"),
    ("stiffness", "‖ΔK‖ / ‖K‖"),
    ("mass", "‖ΔM‖ / ‖M‖"),
    ("fit", "Mean error of the fitted frequencies (%)"),
    ("held", "Mean error of the held-out frequencies (%)"),
    ("new", "Entries where the model has no element"),
    ("definite", "Definite"),
    ("spurious", "Spurious modes"),
    ("where", "Most change at"),
)


def direct_rows(updated: Updated) -> list[dict[str, Any]]:
    """One row for each method, as text; none where the method was another."""
    return [_row(d, updated.method == f"direct: {d.name}") for d in updated.direct]


def direct_beside(updated: Updated) -> dict[str, Any] | None:
    """The method asked for and the constrained convex update of the same request, property by
    property; None where the method was another, or either could not be done."""
    pair = [d for d in updated.direct if d.name == CONVEX or updated.method == f"direct: {d.name}"]
    if len(pair) != 2 or any(d.why for d in pair):
        return None
    formula, convex = ({**_row(d, False), "says": d.says, "name": d.name} for d in pair)
    rows = [
        {"what": what, "formula": formula[key], "convex": convex[key]} for key, what in COMPARED
    ]
    return {
        "formula": pair[0].title,
        "convex": pair[1].title,
        "rows": rows,
        "says": pair[1].says,
        "figures": [f for f in (_figure(d, updated) for d in pair) if f["picture"]],
    }


def _figure(d: DirectResult, updated: Updated) -> dict[str, Any]:
    geometry = updated.geometry
    if geometry is None or not drawable(geometry):
        return {"picture": None}
    worth = {n: (part, f"n{n}") for n, part in d.by_node}
    title = f"What {d.title} changes where"
    picture = place_map(f"change-{d.name}", title, geometry, worth, shown=NAMED)
    most = ", ".join(d.where)
    return {
        "picture": None if picture is None else Markup(picture),
        "says": f"{d.title}: part of the squared change at each node, largest at {most}.",
    }


def _row(d: DirectResult, chosen: bool) -> dict[str, Any]:
    return {
        "title": f"{d.title} ({d.equations})" if d.equations else d.title,
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
