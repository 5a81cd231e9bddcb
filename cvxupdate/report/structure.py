"""The structure in a figure: elements, displaced shapes, nodal lines, labels beside points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.svg import AFTER, GRID, HELD, INK, QUIET
from cvxupdate.report.views import View

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry

Real = NDArray[Any]
WIDTH = 4.7
LARGEST = 4000
"""Elements drawn at most: more make a page too heavy for a browser."""
REACH = 0.16
"""Largest displacement drawn, in lengths of the structure."""


def drawable(geometry: Geometry | None) -> bool:
    """Whether there is something to draw, and not too much."""
    return geometry is not None and len(geometry.parts) <= LARGEST


def nodal_lines(ax: Any, geometry: Geometry, height: Real) -> None:
    """A plate from above: where it moves one way (shaded), the other way (blank), and not at all
    (lines)."""
    from matplotlib.colors import to_rgba
    from matplotlib.tri import Triangulation

    halves = ((0, 1, 2), (0, 2, 3))
    triangles = [
        [p.nodes[k] for k in half]
        for p in geometry.parts
        for half in halves[: max(len(p.nodes) - 2, 0)]
    ]
    mesh = Triangulation(geometry.xyz[:, 0], geometry.xyz[:, 1], np.array(triangles))
    top = max(float(np.abs(height).max()), 1e-300)
    ax.tricontourf(
        mesh,
        height / top,
        levels=[-1.01, 0.0, 0.35, 0.7, 1.01],
        colors=[to_rgba(GRID, 0.35), *(to_rgba(AFTER, a) for a in (0.25, 0.5, 0.8))],
    )
    ax.tricontour(mesh, height / top, levels=[0.0], colors=[INK], linewidths=0.8)


def skeleton(
    ax: Any,
    geometry: Geometry,
    view: View,
    fraction: dict[int, float] | None = None,
    moved: Real | None = None,
    faint: bool = False,
) -> None:
    """Elements as lines and areas. ``fraction`` colours them, ``moved`` (nodes, 3) displaces them,
    ``faint`` is for what lies behind."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import to_rgba

    at = view.project(geometry.xyz) if moved is None else displaced(view, geometry.xyz, moved)
    lines = [p for p in geometry.parts if len(p.nodes) == 2]
    areas = [p for p in geometry.parts if len(p.nodes) > 2]
    top = max(max(fraction.values(), default=0.0), 1e-300) if fraction else 1.0
    plain = GRID if faint else QUIET if moved is None else AFTER
    if areas:
        edge = to_rgba(plain, 0.5 if len(areas) < 400 else 0.22)
        fills = (
            [to_rgba(HELD, 0.85 * fraction.get(p.id, 0.0) / top) for p in areas]
            if fraction
            else [to_rgba(GRID, 0.0 if faint else 0.25)] * len(areas)
        )
        ax.add_collection(
            PolyCollection(
                [at[list(p.nodes)] for p in areas],
                facecolors=fills,
                edgecolors=edge,
                linewidths=0.5,
                zorder=2,
            )
        )
    if lines:
        weight = [fraction.get(p.id, 0.0) / top for p in lines] if fraction else [0.0] * len(lines)
        dashed = ["--" if p.kind in ("spring", "dashpot") else "-" for p in lines]
        ax.add_collection(
            LineCollection(
                [at[list(p.nodes)] for p in lines],
                colors=plain,
                linewidths=1.1,
                linestyles=dashed,
                zorder=2,
            )
        )
        if fraction:
            ax.add_collection(
                LineCollection(
                    [at[list(p.nodes)] for p in lines],
                    colors=[to_rgba(HELD, 0.15 + 0.85 * w if w > 0.02 else 0.0) for w in weight],
                    linewidths=[1.5 + 5.0 * w for w in weight],
                    zorder=3,
                )
            )
    dots = sorted({n for p in geometry.parts if len(p.nodes) == 1 for n in p.nodes})
    if dots and not faint:
        ax.plot(at[dots, 0], at[dots, 1], "s", color=plain, ms=3.5, mew=0, ls="", zorder=3)
    ax.update_datalim(at)
    ax.autoscale_view()


def displaced(view: View, xyz: Real, motion: Real) -> Real:
    """Displaced places in the figure; motion along a line is drawn across it."""
    at = view.project(xyz)
    if not view.aside:
        return np.asarray(at + view.project(motion))
    return np.column_stack([at[:, 0], view.project(motion)[:, 0]])


def label_points(
    ax: Any, named: Sequence[tuple[Real, str]], geometry: Geometry, view: View
) -> None:
    """Labels beside points, each at the first of a few places around its point that no earlier
    label covers."""
    flat = view.project(geometry.xyz)
    per_point = 1.25 * max(
        float(np.ptp(flat[:, 0])) / (72 * WIDTH),
        float(np.ptp(flat[:, 1])) / (72 * _height(view, geometry)),
        1e-300,
    )
    middle = float(np.mean([flat[:, 0].min(), flat[:, 0].max()]))
    taken: list[tuple[float, float, float, float]] = []
    for at, text in named:
        x, y, width = float(at[0]) / per_point, float(at[1]) / per_point, 4.9 * len(text)
        for up in (7.0, -14.0, 19.0, -26.0, 31.0, -38.0):
            left = float(at[0]) > middle
            start = x - 9.0 - width if left else x + 9.0
            box = (start, y + up, start + width, y + up + 10.0)
            if all(box[2] < o[0] or o[2] < box[0] or box[3] < o[1] or o[3] < box[1] for o in taken):
                break
        taken.append(box)
        ax.annotate(
            text,
            (float(at[0]), float(at[1])),
            (-9.0 if left else 9.0, up),
            textcoords="offset points",
            fontsize=8.5,
            color=INK,
            zorder=7,
            ha="right" if left else "left",
        )


def extent(geometry: Geometry) -> float:
    """The longest side of the box that holds the structure, m."""
    return float(np.ptp(geometry.xyz, axis=0).max())


def _bare(ax: Any, view: View) -> None:
    ax.set_aspect("auto" if view.aside else "equal")
    ax.margins(0.1)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)


def _height(view: View, geometry: Geometry, width: float = WIDTH) -> float:
    if view.aside:
        return 1.6
    flat = np.ptp(view.project(geometry.xyz), axis=0)
    return float(
        np.clip(
            width * (flat[1] + 2 * REACH * flat.max()) / max(float(flat[0]) * 1.1, 1e-300),
            1.4,
            1.25 * width,
        )
    )
