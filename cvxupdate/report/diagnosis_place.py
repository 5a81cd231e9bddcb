"""The picture of the finding: the structure with what is known of it (supports, sensors, forces,
axes, sizes) and every finding marked."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.diagnosis_places import (
    WIDTH,
    Sketch,
    draw_numbers,
    draw_supports,
    sketch_of,
    sketch_view,
)
from cvxupdate.report.numbers import number
from cvxupdate.report.structure import _bare, _height, skeleton
from cvxupdate.report.svg import AFTER, HELD, INK, PAPER, QUIET, draw
from cvxupdate.report.views import View

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.spec import Spec

Real = NDArray[np.float64]
KINDS = ("x", "y", "z")
ARROW, TRIAD = 24.0, 20.0
"""Lengths of the arrow of a force and of an axis, in points."""
LETTER, LINE = 6.6, 13.0
"""Width of a bold letter of 10 points and height of a line, in points."""
CLEAR, EDGE = 12.0, 6.0
"""Distances of a name from its mark and from the edge of the picture, in points."""
LOW = 0.9
"""Inches of a picture beside the names above one mark: many of them would leave a flat structure
none."""


def place_picture(found: Diagnosis, spec: Spec) -> str | None:
    """The structure with every finding marked: elements thick and coloured, nodes ringed and named;
    supports as triangles."""
    sketch = sketch_of(spec)
    if sketch is None or np.ptp(sketch.xyz, axis=0).max(initial=0.0) == 0.0:
        return None  # one point is no picture
    drawing = cast("Geometry", sketch)  # the same fields, made from the problem file alone
    marked, rings = _marks(found, sketch)
    view = sketch_view(sketch)
    flat = view.project(sketch.xyz)

    def paint(ax: Any) -> None:
        skeleton(ax, drawing, view, marked or None)
        draw_supports(ax, sketch, flat)
        draw_numbers(ax, sketch, flat)
        if found.beside is not None:
            draw_measured(ax, sketch, view, found.beside.sensors, found.beside.forces)
        up = CLEAR
        for rows, text, ringed in rings:
            if ringed:
                _ring(ax, flat[rows])
            up += _named(ax, flat, rows, text, up, size)
        _bare(ax, view)
        ax.margins(0.12)
        _axes(ax, view)

    names = CLEAR + sum(LINE * len(_lines(text, WIDTH)) for _, text, _ in rings)
    size = (WIDTH, max(1.7, _height(view, drawing), LOW + names / 72.0))
    says = "The structure; " + (
        ", ".join(f.says for f in found.findings) if found.findings else "no place is marked"
    )
    return draw("place", says, *size, paint)


def _marks(
    found: Diagnosis, sketch: Sketch
) -> tuple[dict[int, float], list[tuple[list[int], str, bool]]]:
    """Elements to be drawn thick, and the rows of nodes that carry a name, with the name and
    whether they are ringed; nothing of elements that are not drawn."""
    at_node = {int(n): k for k, n in enumerate(sketch.node_ids)}
    marked: dict[int, float] = {}
    rings: list[tuple[list[int], str, bool]] = []
    drawn = {part.id: part for part in sketch.parts}
    for f in found.findings:
        marked |= {int(e): 1.0 for e in f.place.elements}
        rows = [at_node[n] for n in f.place.nodes if n in at_node]
        some = [drawn[e] for e in f.place.elements if e in drawn]
        if not rows and some:
            rings.append((list(some[len(some) // 2].nodes), f.title, False))
        elif rows:
            rings.append((rows, f.title, True))
            if len(rows) == 2:
                marked |= {p.id: 1.0 for p in sketch.parts if set(p.nodes) == set(rows)}
    return marked, rings


def size_words(spec: Spec) -> str:
    """The extent along the axes, in words; empty where the model has no coordinates."""
    xyz = np.array([[n.x, n.y, n.z] for n in spec.model.nodes], dtype=float).reshape(-1, 3)
    sizes = np.ptp(xyz, axis=0) if len(xyz) else np.zeros(3)
    parts = [f"{number(float(s), 3)} m along {k}" for s, k in zip(sizes, KINDS, strict=True) if s]
    return ", ".join(parts)


def draw_measured(
    ax: Any, sketch: Sketch, view: View, sensors: Sequence[str], forces: Sequence[str]
) -> None:
    """Sensors as dots, forces as arrows along their direction; about an axis, or towards the eye,
    as a ring. Both are labels, ``n4.z``."""
    flat = view.project(sketch.xyz)
    at = {int(n): k for k, n in enumerate(sketch.node_ids)}
    rows = sorted({at[n] for n, _ in map(_split, sensors) if n in at})
    ax.plot(flat[rows, 0], flat[rows, 1], "o", color=INK, ms=4.2, mew=0, ls="", zorder=4)
    for node, dof in map(_split, forces):
        if node not in at:
            continue
        point = flat[at[node]]
        along = view.project(np.eye(3)[KINDS.index(dof)]) if dof in KINDS else np.zeros(2)
        length = float(np.linalg.norm(along))
        if length < 0.2:
            ax.plot(*point, "o", mfc="none", mec=AFTER, mew=1.6, ms=9, zorder=5)
            continue
        start = -ARROW * along / length
        ax.annotate(
            "",
            tuple(point),
            tuple(start),
            textcoords="offset points",
            arrowprops={"arrowstyle": "-|>", "color": AFTER, "lw": 1.6},
            zorder=5,
        )


def _split(label: str) -> tuple[int, str]:
    """``n4.z`` as (4, "z")."""
    node, _, dof = label.partition(".")
    return (int(node[1:]) if node[1:].isdigit() else -1), dof


def _axes(ax: Any, view: View) -> None:
    """The directions x, y, z in a corner; one that points to the eye is left out."""
    for k, name in enumerate(KINDS):
        along = view.project(np.eye(3)[k])
        if float(np.linalg.norm(along)) < 0.15:
            continue
        tip = (TRIAD * float(along[0]) - TRIAD, TRIAD * float(along[1]) - TRIAD)
        ax.annotate(
            "",
            tip,
            (-TRIAD, -TRIAD),
            xycoords="axes points",
            textcoords="axes points",
            arrowprops={"arrowstyle": "->", "color": QUIET, "lw": 1.0, "shrinkA": 0, "shrinkB": 0},
        )
        end = (tip[0] + 5.0 * float(along[0]), tip[1] + 5.0 * float(along[1]))
        ax.annotate(
            name, end, xycoords="axes points", ha="center", va="center", fontsize=8.5, color=QUIET
        )


def _ring(ax: Any, at: Real) -> None:
    ax.plot(
        at[:, 0],
        at[:, 1],
        "o",
        mfc=PAPER,
        mec=HELD,
        mew=2.6,
        ms=13,
        ls="",
        zorder=6,
    )
    ax.plot(at[:, 0], at[:, 1], "o", color=HELD, mew=0, ms=5, ls="", zorder=7)


def _named(
    ax: Any, flat: Real, rows: list[int], text: str, up: float, size: tuple[float, float]
) -> float:
    """The name of a finding ``up`` points above its mark, not across it and not beyond the
    picture of ``size`` inches; gives the height that it takes."""
    at = float(flat[rows, 0].mean()), float(flat[rows, 1].max())
    lines = _lines(text, size[0])
    ax.annotate(
        "\n".join(lines),
        at,
        (name_offset(flat, at[0], max(map(len, lines)), size), up),
        textcoords="offset points",
        ha="left",
        va="bottom",
        fontsize=10,
        color=INK,
        fontweight="bold",
        zorder=8,
    )
    return LINE * len(lines)


def _lines(text: str, width: float) -> list[str]:
    """A name in lines that fit a picture ``width`` inches wide."""
    return textwrap.wrap(text, int((72.0 * width - 2 * EDGE) / LETTER)) or [text]


def name_offset(flat: Real, x: float, letters: int, size: tuple[float, float]) -> float:
    """Where a name of so many ``letters`` begins, in points beside its mark at ``x``: at the mark
    or, where it would leave the picture (``size`` inches), as far to the left as it needs. The page
    sets it in its own font, so a letter counts as wide as fonts make it."""
    width, height = 72.0 * size[0], 72.0 * size[1]
    spread = np.maximum(np.ptp(flat, axis=0), 1e-300) * 1.24  # margins of 0.12 on both sides
    scale = min(width / float(spread[0]), height / float(spread[1]))
    mark = 0.5 * width + (x - 0.5 * float(flat[:, 0].min() + flat[:, 0].max())) * scale
    long = LETTER * letters
    start = mark - long if mark > 0.5 * width else mark
    return float(np.clip(start, EDGE, max(EDGE, width - long - EDGE))) - mark
