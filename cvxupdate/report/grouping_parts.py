"""The macro elements that the recordings chose, on the structure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report.numbers import number
from cvxupdate.report.structure import WIDTH, _bare, _height, drawable, skeleton
from cvxupdate.report.svg import AFTER, HELD, INK, draw
from cvxupdate.report.views import view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.update.result import Grouping, Updated

FAINT, FULL = 0.06, 0.6
"""Opacity of a group that does not change, and of the one that changes most."""
NUMBERED = 200
"""Elements that are numbered one by one at most; beyond, one of each group is."""
SMALL = 60
"""Numbered elements beyond which numbers are small."""
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
            "figure": _figure(f"grouping{place}", updated.geometry, g, value),
        }
        for place, g in enumerate(updated.groupings)
    ]


def _figure(
    name: str, geometry: Geometry | None, found: Grouping, value: Mapping[str, float]
) -> Markup | None:
    if geometry is None or not drawable(geometry):
        return None
    still = np.zeros(3, dtype=bool)  # nothing moves here, so flat structures are seen from above
    view = view_of(geometry.xyz, still)
    group = {e: k for k, members in enumerate(found.elements, 1) for e in members}
    mine = [p for p in geometry.parts if p.id in group]
    numbered = {p.id for p in mine} if len(mine) <= NUMBERED else {g[0] for g in found.elements}
    moved = np.array([value.get(n, 0.0) for n in found.names])
    strength = np.abs(moved) / max(float(np.abs(moved).max(initial=0.0)), 1e-12)

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view, faint=True)
        at = view.project(geometry.xyz)
        for part in mine:
            k = group[part.id]
            colour, corners = AFTER if moved[k - 1] > 0.0 else HELD, at[list(part.nodes)]
            opacity = FAINT + (FULL - FAINT) * strength[k - 1]
            if len(part.nodes) == 2:
                ax.plot(corners[:, 0], corners[:, 1], color=colour, lw=4, alpha=opacity, zorder=3)
            elif len(part.nodes) > 2:
                x, y = corners.T
                ax.fill(x, y, color=colour, alpha=opacity, lw=0, zorder=3)
            if part.id in numbered:
                x, y = corners.mean(axis=0)
                ax.annotate(
                    str(k),
                    (x, y),
                    ha="center",
                    va="center",
                    fontsize=8 if len(numbered) <= SMALL else 6,
                    color=INK,
                    bbox={"boxstyle": "round,pad=0.1", "fc": "none", "ec": "none"},
                    zorder=5,
                )
        _bare(ax, view)

    says = f"Groups of '{found.of}' that the recordings chose, numbered on the structure"
    picture = draw(name, says, WIDTH, _height(view, geometry), paint)
    return Markup(picture) if picture else None
