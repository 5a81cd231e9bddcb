"""How much each place of a structure counts, as circles on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.structure import WIDTH, _bare, _height, label_points, skeleton
from cvxupdate.report.svg import AFTER, INK, draw
from cvxupdate.report.views import view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry

SHOWN = 12
"""Places that carry their name."""


def place_map(
    name: str,
    title: str,
    geometry: Geometry,
    worth: Mapping[int, tuple[float, str]],
    top: float | None = None,
    shown: int = SHOWN,
) -> str | None:
    """A circle at each node, its area as the node's ``worth`` (figure, label), the largest as
    ``top`` (None: the largest one there); ``shown`` carry their label. None where no node is on the
    structure."""
    at = {int(n): k for k, n in enumerate(geometry.node_ids)}
    known = {n: w for n, w in worth.items() if n in at}
    if not known:
        return None
    view = view_of(geometry.xyz, np.any(geometry.moves, axis=0))
    flat = view.project(geometry.xyz)
    whole = top or max(w for w, _ in known.values()) or 1.0

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view)
        xy = np.array([flat[at[n]] for n in known])
        sizes = [8.0 + 110.0 * w / whole for w, _ in known.values()]
        ax.scatter(xy[:, 0], xy[:, 1], s=sizes, color=AFTER, alpha=0.65, edgecolors=INK, lw=0.5)
        order = sorted(known, key=lambda n: -known[n][0])[:shown]
        label_points(ax, [(flat[at[n]], known[n][1]) for n in order], geometry, view)
        _bare(ax, view)

    return draw(name, title, WIDTH, _height(view, geometry), paint)
