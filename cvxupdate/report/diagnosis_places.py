"""The structure as a diagnosis draws it, and the map of where a cause may sit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.structure import LARGEST, _bare, _height, skeleton
from cvxupdate.report.svg import HELD, INK, QUIET, draw
from cvxupdate.report.views import View, view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.diagnose.shown import Shown
    from cvxupdate.spec import Spec

Real = NDArray[np.float64]
WIDTH = 4.7
CROWD = 40
"""Nodes up to which each is numbered."""
FAINT = 0.02
"""Explained fraction, of the largest, below which a place is left blank."""


@dataclass(frozen=True)
class Piece:
    """One element, or a face of a solid: id, type in the problem file, nodes as rows of
    `Sketch.xyz`."""

    id: int
    kind: str
    nodes: tuple[int, ...]


@dataclass(frozen=True)
class Sketch:
    """What is drawn, with the fields of `correlate.result.Geometry`; ``held`` are the rows
    of supported nodes."""

    node_ids: NDArray[np.int64]
    xyz: NDArray[np.float64]
    parts: tuple[Piece, ...]
    moves: NDArray[np.bool_]
    held: tuple[int, ...]


def sketch_of(spec: Spec) -> Sketch | None:
    """The structure of a problem file; nodes without coordinates of their own stand in a row. None
    when there is nothing, or too much, to draw."""
    nodes = spec.model.nodes
    ids = np.array([n.id for n in nodes], dtype=np.int64)
    at = {int(n): k for k, n in enumerate(ids)}
    xyz = np.array([[n.x, n.y, n.z] for n in nodes], dtype=float).reshape(-1, 3)
    parts = tuple(
        Piece(number, block.type, tuple(at[n] for n in nodes))
        for block in spec.model.elements
        for number, nodes in block.drawn()
    )
    if not parts or len(parts) > LARGEST or len(ids) < 2:
        return None  # one node is nothing to draw
    if np.ptp(xyz, axis=0).max() == 0.0:
        xyz[:, 0] = np.arange(len(xyz))
    moves = np.tile([k in spec.model.dofs for k in "xyz"], (len(ids), 1))
    held: set[int] = set()
    for support in spec.model.supports:
        if set(support.dofs) & set(spec.model.dofs):
            held |= (
                set(range(len(ids)))
                if support.nodes == "all"
                else {at[n] for n in support.nodes if n in at}
            )
    return Sketch(ids, xyz, parts, moves, tuple(sorted(held)) if len(held) < len(ids) else ())


def sketch_view(sketch: Sketch) -> View:
    """That of the structure; the ways it moves count only where it is not flat."""
    return view_of(
        sketch.xyz,
        np.array([False] * 3)
        if np.ptp(sketch.xyz, axis=0).min() == 0.0
        else np.asarray(sketch.moves.any(axis=0)),
    )


def draw_supports(ax: Any, sketch: Sketch, flat: Real) -> None:
    """A triangle at every supported node."""
    ax.plot(
        flat[list(sketch.held), 0],
        flat[list(sketch.held), 1],
        "^",
        color=QUIET,
        ms=8,
        mew=0,
        ls="",
        zorder=3,
    )


def draw_numbers(ax: Any, sketch: Sketch, flat: Real) -> None:
    """Those of the nodes, where there are few."""
    if len(flat) <= CROWD:
        for n, point in zip(sketch.node_ids.tolist(), flat, strict=True):
            ax.annotate(
                str(n),
                (point[0], point[1]),
                (3, -10),
                textcoords="offset points",
                ha="left",
                va="top",
                fontsize=7.5,
                color=QUIET,
            )


def map_picture(shown: Shown | None, spec: Spec) -> str | None:
    """The structure with the fraction of the mismatch that the best effect at each place could
    explain: nodes as circles, elements thick."""
    sketch = sketch_of(spec)
    if shown is None or sketch is None or not (shown.nodes or shown.elements):
        return None
    drawing = cast("Geometry", sketch)
    at_node = {int(n): k for k, n in enumerate(sketch.node_ids)}
    top = max([*shown.nodes.values(), *shown.elements.values()])
    view = sketch_view(sketch)
    flat = view.project(sketch.xyz)
    lively = sorted(
        ((at_node[n], s) for n, s in shown.nodes.items() if n in at_node and s > FAINT * top),
        key=lambda item: -item[1],
    )
    best = max(
        ((s, f"node {n}", at_node[n]) for n, s in shown.nodes.items() if n in at_node), default=None
    )

    def paint(ax: Any) -> None:
        skeleton(
            ax, drawing, view, {e: s for e, s in shown.elements.items() if s > FAINT * top} or None
        )
        rows = [k for k, _ in lively]
        ax.scatter(
            flat[rows, 0],
            flat[rows, 1],
            s=[20 + 240 * (s / top) ** 2 for _, s in lively],
            color=HELD,
            alpha=0.45,
            linewidths=0,
            zorder=5,
        )
        draw_supports(ax, sketch, flat)
        if best is not None and len(flat) > CROWD:
            ax.annotate(
                best[1],
                (flat[best[2], 0], flat[best[2], 1]),
                (8, 8),
                textcoords="offset points",
                fontsize=9,
                color=INK,
                zorder=8,
            )
        draw_numbers(ax, sketch, flat)
        _bare(ax, view)
        ax.margins(0.12)

    return draw(
        "map",
        "Fraction of the mismatch that the best effect at each place could explain, "
        "drawn on the structure",
        WIDTH,
        max(1.7, _height(view, drawing)),
        paint,
    )
