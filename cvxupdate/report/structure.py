"""The structure as a figure: where sensors agree, which elements are out of balance, how modes
move."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.numbers import fixed, number
from cvxupdate.report.svg import AFTER, GRID, HELD, INK, PAPER, QUIET, draw, draw_panels
from cvxupdate.report.views import View, view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Compared, Drawing, ShapeComparison

Real = NDArray[Any]
WIDTH = 4.7
NAMED = 4
"""Sensors and elements that a figure names."""
COLUMNS = 5
"""Panels beside one another for a plate seen from above."""
MODES = 6
"""Mode shapes drawn at most."""
LARGEST = 4000
"""Elements drawn at most: more make a page that no browser likes."""
REACH = 0.16
"""Largest displacement drawn, in lengths of the structure."""


def drawable(drawing: Drawing | None) -> bool:
    """Whether there is something to draw, and not too much."""
    return drawing is not None and len(drawing.parts) <= LARGEST


def comac_picture(name: str, drawing: Drawing, found: ShapeComparison) -> str | None:
    """COMAC at every sensor: a large full circle where model and measurement disagree; the worst
    are named."""
    values = np.asarray(found.correlation.comac)
    good = np.isfinite(values)
    if not good.any():
        return None
    view = view_of(drawing.xyz, _moving(found.kinds))
    at = view.project(drawing.xyz[found.nodes])
    worst = [
        int(i)
        for i in np.argsort(np.where(good, values, 2.0))[:NAMED]
        if good[i] and values[i] < 0.98
    ]

    def paint(ax: Any) -> None:
        skeleton(ax, drawing, view)
        lack = np.where(good, 1.0 - values, 0.0)
        ax.scatter(
            at[:, 0], at[:, 1], s=16, facecolors=PAPER, edgecolors=AFTER, linewidths=1.1, zorder=4
        )
        ax.scatter(
            at[good, 0],
            at[good, 1],
            s=260 * lack[good] / max(float(lack.max()), 0.1),
            color=HELD,
            alpha=0.75,
            linewidths=0,
            zorder=5,
        )
        _name(
            ax,
            [(at[i], f"{found.labels[i]}  {fixed(float(values[i]), 2)}") for i in worst],
            drawing,
            view,
        )
        _bare(ax, view)

    return draw(
        name,
        "Coordinate MAC at each sensor, drawn on the structure; large circles are disagreement",
        WIDTH,
        _height(view, drawing),
        paint,
    )


def balance_picture(
    name: str, drawing: Drawing, ids: Real, share: Real, change: Real
) -> str | None:
    """The share of the imbalance that each element explains: thick and coloured where it is large;
    the first are named with their change."""
    if not len(ids) or not np.any(share > 0.0):
        return None
    view = view_of(drawing.xyz, np.asarray(drawing.moves.any(axis=0)))
    value = dict(zip(ids.tolist(), share.tolist(), strict=True))
    first = [
        int(i)
        for i in np.argsort(-share)[:NAMED]
        if share[i] > max(0.02, 0.35 * float(share.max()))
    ]
    delta = dict(zip(ids.tolist(), change.tolist(), strict=True))

    def paint(ax: Any) -> None:
        skeleton(ax, drawing, view, value)
        middle = {
            part.id: view.project(drawing.xyz[list(part.nodes)].mean(axis=0))
            for part in drawing.parts
        }
        _name(
            ax,
            [
                (middle[e], f"e{e}  {fixed(100 * value[e], 0)} %, {_percent(delta[e])}")
                for e in (int(ids[i]) for i in first)
            ],
            drawing,
            view,
        )
        _bare(ax, view)

    return draw(
        name,
        "Share of the force imbalance that each element explains, drawn on the structure",
        WIDTH,
        _height(view, drawing),
        paint,
    )


def shape_panels(name: str, drawing: Drawing, found: ShapeComparison) -> str | None:
    """Model shapes (lines) with the measured motion at the sensors (points) for the first paired
    modes."""
    if found.model_shapes is None or not found.correlation.pairing.model.size:
        return None
    count = min(found.model_shapes.shape[2], MODES)
    view = view_of(
        drawing.xyz, _moving(found.kinds) | np.any(np.abs(found.model_shapes) > 1e-6, axis=(0, 2))
    )
    columns = min(count, 2 if not view.aside else 1)
    rows = -(-count // columns)
    size = _size(drawing)
    c = found.correlation

    def paint(axes: list[Any]) -> None:
        for k, ax in enumerate(axes):
            ax.set_visible(k < count)
            if k >= count:
                continue
            model, measured = np.real(found.model_shapes[:, :, k]), np.real(c.shapes_measured[:, k])  # type: ignore[index]
            scale = (
                REACH
                * size
                / max(
                    float(np.abs(model).max()),
                    float(np.nanmax(np.abs(measured), initial=0.0)),
                    1e-300,
                )
            )
            skeleton(ax, drawing, view, faint=True)
            skeleton(ax, drawing, view, moved=scale * model)
            ok = np.flatnonzero(np.isfinite(measured) & (found.kinds < 3))
            motion = np.zeros((len(ok), 3))
            motion[np.arange(len(ok)), found.kinds[ok]] = scale * measured[ok]
            here = drawing.xyz[found.nodes[ok]]
            a, b = view.project(here), _place(view, here, motion)
            for p, q in zip(a, b, strict=True):
                ax.plot([p[0], q[0]], [p[1], q[1]], color=HELD, lw=0.8, alpha=0.7, zorder=4)
            ax.plot(b[:, 0], b[:, 1], "o", color=HELD, ms=3.2, mew=0, ls="", zorder=5)
            ax.set_title(
                f"mode {found.measured_number[k]}: {number(float(c.frequency_measured[k]))} "
                f"Hz, model {number(float(c.frequency_model[k]))} Hz, MAC "
                f"{fixed(float(c.pairing.mac[k]), 2)}",
                fontsize=8.5,
            )
            _bare(ax, view)

    each = _height(view, drawing, 2 * WIDTH / columns if columns > 1 else WIDTH) + 0.15
    says = "Model mode shapes with the measured motion at the sensors"
    return draw_panels(
        name, says, 2 * WIDTH if columns > 1 else WIDTH, each * rows, rows, columns, paint
    )


def nominal_panels(name: str, compared: Compared) -> str | None:
    """The model's modes that were paired without shapes: plates by their nodal lines, other
    structures displaced."""
    drawing = compared.drawing
    if drawing is None or not drawable(drawing) or not compared.nominal:
        return None
    pairs = [m for m in compared.modes if m.mode in compared.nominal and m.mac is None][
        : 5 * COLUMNS
    ]
    areas = sum(len(p.nodes) > 2 for p in drawing.parts)
    flat = (
        areas > 0
        and np.ptp(drawing.xyz[:, 2]) == 0.0
        and not any(len(p.nodes) == 2 for p in drawing.parts)
    )
    pairs = pairs if flat else pairs[:MODES]
    view = view_of(
        drawing.xyz, np.array([False] * 3) if flat else np.asarray(drawing.moves.any(axis=0))
    )
    columns = min(len(pairs), COLUMNS if flat else 2)
    rows = -(-len(pairs) // columns)

    def paint(axes: list[Any]) -> None:
        for ax, m in itertools.zip_longest(axes, pairs):
            ax.set_visible(m is not None)
            if m is None:
                continue
            motion = compared.nominal[m.mode]
            if flat:
                nodal_lines(ax, drawing, motion[:, 2])
            else:
                skeleton(ax, drawing, view, faint=True)
                skeleton(
                    ax,
                    drawing,
                    view,
                    moved=REACH
                    * _size(drawing)
                    * motion
                    / max(float(np.abs(motion).max()), 1e-300),
                )
            ax.set_title(
                f"{number(m.measured)} Hz: mode {m.mode}, {number(m.model)} Hz",
                fontsize=7.5 if flat else 8.5,
            )
            _bare(ax, view)

    width = 2 * WIDTH
    each = _height(view, drawing, width / columns) * (0.8 if flat else 1.0) + 0.15
    return draw_panels(
        name,
        "Mode shapes of the model beside the measured frequencies they are paired with",
        width,
        each * rows,
        rows,
        columns,
        paint,
    )


def nodal_lines(ax: Any, drawing: Drawing, height: Real) -> None:
    """A plate from above: where it moves one way (shaded), the other way (blank), and not at all
    (lines)."""
    from matplotlib.colors import to_rgba
    from matplotlib.tri import Triangulation

    corners = np.array(
        [
            [p.nodes[0], p.nodes[1], p.nodes[2], p.nodes[3]]
            for p in drawing.parts
            if len(p.nodes) == 4
        ]
    )
    mesh = Triangulation(
        drawing.xyz[:, 0],
        drawing.xyz[:, 1],
        np.vstack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]),
    )
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
    drawing: Drawing,
    view: View,
    share: dict[int, float] | None = None,
    moved: Real | None = None,
    faint: bool = False,
) -> None:
    """Elements as lines and areas. ``share`` colours them, ``moved`` (nodes, 3) displaces them,
    ``faint`` is for what lies behind."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import to_rgba

    at = view.project(drawing.xyz) if moved is None else _place(view, drawing.xyz, moved)
    lines = [p for p in drawing.parts if len(p.nodes) == 2]
    areas = [p for p in drawing.parts if len(p.nodes) > 2]
    top = max(max(share.values(), default=0.0), 1e-300) if share else 1.0
    plain = GRID if faint else QUIET if moved is None else AFTER
    if areas:
        edge = to_rgba(plain, 0.5 if len(areas) < 400 else 0.22)
        fills = (
            [to_rgba(HELD, 0.85 * share.get(p.id, 0.0) / top) for p in areas]
            if share
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
        weight = [share.get(p.id, 0.0) / top for p in lines] if share else [0.0] * len(lines)
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
        if share:
            ax.add_collection(
                LineCollection(
                    [at[list(p.nodes)] for p in lines],
                    colors=[to_rgba(HELD, 0.15 + 0.85 * w if w > 0.02 else 0.0) for w in weight],
                    linewidths=[1.5 + 5.0 * w for w in weight],
                    zorder=3,
                )
            )
    dots = sorted({n for p in drawing.parts if len(p.nodes) == 1 for n in p.nodes})
    if dots and not faint:
        ax.plot(at[dots, 0], at[dots, 1], "s", color=plain, ms=3.5, mew=0, ls="", zorder=3)
    ax.update_datalim(at)
    ax.autoscale_view()


def _place(view: View, xyz: Real, motion: Real) -> Real:
    """Displaced places in the figure; motion along a line is drawn across it."""
    at = view.project(xyz)
    if not view.aside:
        return np.asarray(at + view.project(motion))
    return np.column_stack([at[:, 0], view.project(motion)[:, 0]])


def _moving(kinds: Real) -> NDArray[np.bool_]:
    return np.array([bool(np.any(kinds == k)) for k in range(3)])


def _percent(change: float) -> str:
    return f"{100 * change:+.0f} %".replace("-", "−")


def _name(ax: Any, named: Sequence[tuple[Real, str]], drawing: Drawing, view: View) -> None:
    """Labels beside points, each at the first of a few places around its point that no earlier
    label covers."""
    flat = view.project(drawing.xyz)
    per_point = 1.25 * max(
        float(np.ptp(flat[:, 0])) / (72 * WIDTH),
        float(np.ptp(flat[:, 1])) / (72 * _height(view, drawing)),
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


def _size(drawing: Drawing) -> float:
    return float(np.ptp(drawing.xyz, axis=0).max())


def _bare(ax: Any, view: View) -> None:
    ax.set_aspect("auto" if view.aside else "equal")
    ax.margins(0.1)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)


def _height(view: View, drawing: Drawing, width: float = WIDTH) -> float:
    if view.aside:
        return 1.6
    flat = np.ptp(view.project(drawing.xyz), axis=0)
    return float(
        np.clip(
            width * (flat[1] + 2 * REACH * flat.max()) / max(float(flat[0]) * 1.1, 1e-300),
            1.4,
            1.25 * width,
        )
    )
