"""The macro elements that the recordings chose, on the structure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report.numbers import number
from cvxupdate.report.structure import WIDTH, _bare, _height, drawable, skeleton
from cvxupdate.report.svg import AFTER, BEFORE, HELD, INK, draw
from cvxupdate.report.views import view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.update.result import Grouping, Updated

COLOURS = (AFTER, HELD, BEFORE, INK)
"""One after another; the number tells groups of one colour apart."""
NUMBERED = 120
"""Elements that are numbered one by one at most; beyond, one of each group is."""
LISTED = 60
"""Groups in a table at most; result.json holds them all."""


def grouping_parts(updated: Updated) -> list[dict[str, Any]]:
    """A sentence, a table of groups and a figure for each row of parameters that asked for it."""
    value = {q.name: q.p for q in updated.parameters}
    return [
        {
            "of": g.of,
            "says": g.says,
            "rows": [
                {
                    "number": k,
                    "name": name,
                    "members": len(elements),
                    "deviation": number(deviation, 2),
                    "p": number(value.get(name), 4),
                }
                for k, (name, elements, deviation) in enumerate(
                    list(zip(g.names, g.elements, g.deviation, strict=True))[:LISTED], 1
                )
            ],
            "more": max(0, len(g.names) - LISTED),
            "figure": _figure(f"grouping{place}", updated.geometry, g),
        }
        for place, g in enumerate(updated.groupings)
    ]


def _figure(name: str, geometry: Geometry | None, found: Grouping) -> Markup | None:
    if geometry is None or not drawable(geometry):
        return None
    view = view_of(geometry.xyz, np.asarray(geometry.moves.any(axis=0)))
    group = {e: k for k, members in enumerate(found.elements, 1) for e in members}
    mine = [p for p in geometry.parts if p.id in group]
    numbered = {p.id for p in mine} if len(mine) <= NUMBERED else {g[0] for g in found.elements}

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view, faint=True)
        at = view.project(geometry.xyz)
        for part in mine:
            k = group[part.id]
            colour, corners = COLOURS[(k - 1) % len(COLOURS)], at[list(part.nodes)]
            if len(part.nodes) == 2:
                ax.plot(corners[:, 0], corners[:, 1], color=colour, lw=2.5, zorder=3)
            elif len(part.nodes) > 2:
                ax.fill(corners[:, 0], corners[:, 1], color=colour, alpha=0.35, lw=0, zorder=3)
            if part.id in numbered:
                x, y = corners.mean(axis=0)
                ax.annotate(
                    str(k),
                    (x, y),
                    ha="center",
                    va="center",
                    fontsize=8,
                    color=INK,
                    bbox={"boxstyle": "round,pad=0.1", "fc": "none", "ec": "none"},
                    zorder=5,
                )
        _bare(ax, view)

    says = f"Groups of '{found.of}' that the recordings chose, numbered on the structure"
    picture = draw(name, says, WIDTH, _height(view, geometry), paint)
    return Markup(picture) if picture else None
