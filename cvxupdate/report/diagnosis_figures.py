"""The figures of a diagnosis: the structure with the place marked, and the fit before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.numbers import number
from cvxupdate.report.structure import LARGEST, _bare, _height, skeleton
from cvxupdate.report.svg import AFTER, BEFORE, HELD, INK, PAPER, QUIET, draw
from cvxupdate.report.views import view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.spec import Spec

WIDTH = 4.7
CROWD = 40
"""Nodes up to which each is numbered."""


@dataclass(frozen=True)
class Piece:
    """One element: id, type in the problem file, nodes as rows of `Sketch.xyz`."""

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
        Piece(row.id, block.type, tuple(at[n] for n in row.nodes))
        for block in spec.model.elements
        for row in getattr(block, "rows", ())
        if getattr(row, "nodes", None)
    )
    if not parts or len(parts) > LARGEST:
        return None
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


def place_picture(found: Diagnosis, spec: Spec) -> str | None:
    """The structure with every finding marked: elements thick and coloured, nodes ringed and named;
    supports as triangles."""
    sketch = sketch_of(spec)
    if sketch is None:
        return None
    drawing = cast("Geometry", sketch)  # the same fields, made from the problem file alone
    at_node = {int(n): k for k, n in enumerate(sketch.node_ids)}
    marked: dict[int, float] = {}
    rings: list[tuple[list[int], str]] = []
    for f in found.findings:
        marked |= {int(e): 1.0 for e in f.place.elements}
        rows = [at_node[n] for n in f.place.nodes if n in at_node]
        if not rows and f.place.elements:
            corners = [
                k
                for part in sketch.parts
                if part.id == f.place.elements[len(f.place.elements) // 2]
                for k in part.nodes
            ]
            rings.append((corners, f.title))
        elif rows:
            rings.append((rows, f.title))
            if len(rows) == 2:
                marked |= {p.id: 1.0 for p in sketch.parts if set(p.nodes) == set(rows)}
    view = view_of(
        sketch.xyz,
        np.array([False] * 3)
        if np.ptp(sketch.xyz, axis=0).min() == 0.0
        else np.asarray(sketch.moves.any(axis=0)),
    )
    flat = view.project(sketch.xyz)

    def paint(ax: Any) -> None:
        skeleton(ax, drawing, view, marked or None)
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
        for k, (rows, text) in enumerate(rings):
            whole = found.findings[k].place.nodes
            if whole:
                ax.plot(
                    flat[rows, 0],
                    flat[rows, 1],
                    "o",
                    mfc=PAPER,
                    mec=HELD,
                    mew=2.6,
                    ms=13,
                    ls="",
                    zorder=6,
                )
                ax.plot(flat[rows, 0], flat[rows, 1], "o", color=HELD, mew=0, ms=5, ls="", zorder=7)
            middle = np.array(
                [flat[rows, 0].mean(), flat[rows, 1].max()]
            )  # above the mark, not across it
            left = middle[0] > flat[:, 0].mean()
            ax.annotate(
                text,
                (middle[0], middle[1]),
                (0, 14 + 13 * k),
                textcoords="offset points",
                ha="right" if left else "left",
                fontsize=10,
                color=INK,
                fontweight="bold",
                zorder=8,
            )
        _bare(ax, view)
        ax.margins(0.12)

    says = "The structure; " + (
        ", ".join(f.says for f in found.findings) if found.findings else "no place is marked"
    )
    return draw("place", says, WIDTH, max(1.7, _height(view, drawing)), paint)


def fit_bars(found: Diagnosis, held_out_word: str = "held out") -> str | None:
    """Error before, with the usual scatter allowed, and after, on what was fitted and on what was
    not."""
    groups = [
        (name, found.fit[key])
        for key, name in (("fit", "fitted"), ("hold_out", held_out_word))
        if found.fit.get(key, {}).get("before") is not None
    ]
    if not groups:
        return None
    stages = [
        ("before", "as modelled", BEFORE),
        ("nuisance", "with the usual scatter", QUIET),
        ("after", "with what was found", AFTER),
    ]
    stages = [
        s
        for s in stages
        if any(v.get(s[0]) is not None for _, v in groups)
        and not (
            s[0] == "after"
            and not found.findings
            and any(v.get("nuisance") is not None for _, v in groups)
        )
    ]

    def paint(ax: Any) -> None:
        step = 1.0 / (len(stages) + 0.8)
        top = max(float(v.get(key) or 0.0) for _, v in groups for key, _, _ in stages)
        for row, (_, v) in enumerate(groups):
            for k, (key, label, colour) in enumerate(stages):
                value = v.get(key)
                if value is None:
                    continue
                y = row + (k - (len(stages) - 1) / 2) * step
                ax.barh(
                    [y],
                    [value],
                    height=0.85 * step,
                    color=colour,
                    label=label if row == 0 else None,
                    zorder=2,
                )
                ax.annotate(
                    number(value, 2),
                    (value, y),
                    (4, 0),
                    textcoords="offset points",
                    va="center",
                    fontsize=9,
                    color=INK,
                )
            noise = v.get("noise")
            if noise is not None:
                ax.plot(
                    [noise, noise],
                    [row - 0.48, row + 0.48],
                    color=HELD,
                    lw=1.2,
                    ls=":",
                    label="noise alone" if row == 0 else None,
                    zorder=3,
                )
        ax.set_yticks(range(len(groups)), [name for name, _ in groups])
        ax.set(
            xlim=(0.0, 1.2 * top if top > 0 else 1.0),
            ylim=(len(groups) - 0.4, -0.6),
            xlabel="error (0: perfect)",
        )
        ax.grid(False, axis="y")
        ax.tick_params(axis="y", length=0)
        handles = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
        order = [label for _, label, _ in stages if label in handles] + [
            label for label in ("noise alone",) if label in handles
        ]
        ax.legend(
            [handles[label] for label in order],
            order,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=2,
            handlelength=1.0,
            handletextpad=0.4,
            columnspacing=1.2,
            borderaxespad=0.1,
        )

    return draw(
        "fit",
        "Error of the model before and after, on fitted and on held-out recordings",
        WIDTH,
        1.3 + 0.75 * len(groups),
        paint,
    )
