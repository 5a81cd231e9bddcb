"""Figures on the structure: where sensors agree, which elements are out of balance, how modes
move."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.numbers import fixed, number
from cvxupdate.report.structure import (
    REACH,
    WIDTH,
    _bare,
    _height,
    displaced,
    drawable,
    extent,
    label_points,
    nodal_lines,
    skeleton,
)
from cvxupdate.report.svg import AFTER, HELD, PAPER, draw, draw_panels
from cvxupdate.report.views import View, view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Compared, Geometry, ShapeComparison

Real = NDArray[Any]
NAMED = 4
"""Sensors and elements that a figure names."""
COLUMNS = 5
"""Panels beside one another for a plate seen from above."""
MODES = 6
"""Mode shapes in a figure at most."""


def comac_picture(name: str, geometry: Geometry, found: ShapeComparison) -> str | None:
    """COMAC at every sensor: a large full circle where model and measurement disagree; the worst
    are named."""
    values = np.asarray(found.correlation.comac)
    good = np.isfinite(values)
    if not good.any():
        return None
    view = view_of(geometry.xyz, _moving(found.kinds))
    at = view.project(geometry.xyz[found.nodes])
    worst = [
        int(i)
        for i in np.argsort(np.where(good, values, 2.0))[:NAMED]
        if good[i] and values[i] < 0.98
    ]

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view)
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
        label_points(
            ax,
            [(at[i], f"{found.labels[i]}  {fixed(float(values[i]), 2)}") for i in worst],
            geometry,
            view,
        )
        _bare(ax, view)

    return draw(
        name,
        "Coordinate MAC at each sensor, drawn on the structure; large circles are disagreement",
        WIDTH,
        _height(view, geometry),
        paint,
    )


def balance_picture(
    name: str, geometry: Geometry, ids: Real, fraction: Real, change: Real
) -> str | None:
    """The fraction of the imbalance that each element explains: thick and coloured where large;
    the first are named with their change."""
    if not len(ids) or not np.any(fraction > 0.0):
        return None
    view = view_of(geometry.xyz, np.asarray(geometry.moves.any(axis=0)))
    value = dict(zip(ids.tolist(), fraction.tolist(), strict=True))
    first = [
        int(i)
        for i in np.argsort(-fraction)[:NAMED]
        if fraction[i] > max(0.02, 0.35 * float(fraction.max()))
    ]
    delta = dict(zip(ids.tolist(), change.tolist(), strict=True))

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view, value)
        middle = {
            part.id: view.project(geometry.xyz[list(part.nodes)].mean(axis=0))
            for part in geometry.parts
        }
        label_points(
            ax,
            [
                (middle[e], f"e{e}  {fixed(100 * value[e], 0)} %, {_percent(delta[e])}")
                for e in (int(ids[i]) for i in first)
            ],
            geometry,
            view,
        )
        _bare(ax, view)

    return draw(
        name,
        "Fraction of the force imbalance that each element explains, drawn on the structure",
        WIDTH,
        _height(view, geometry),
        paint,
    )


def shape_panels(name: str, geometry: Geometry, found: ShapeComparison) -> str | None:
    """Model shapes (lines) with the measured motion at the sensors (points) for the first paired
    modes."""
    if found.model_shapes is None or not found.correlation.pairing.model.size:
        return None
    count = min(found.model_shapes.shape[2], MODES)
    view = view_of(
        geometry.xyz, _moving(found.kinds) | np.any(np.abs(found.model_shapes) > 1e-6, axis=(0, 2))
    )
    columns = min(count, 2 if not view.aside else 1)
    rows = -(-count // columns)

    def paint(axes: list[Any]) -> None:
        for k, ax in enumerate(axes):
            ax.set_visible(k < count)
            if k >= count:
                continue
            _shape(ax, geometry, view, found, k)
            _bare(ax, view)

    each = _height(view, geometry, 2 * WIDTH / columns if columns > 1 else WIDTH) + 0.15
    says = "Model mode shapes with the measured motion at the sensors"
    return draw_panels(
        name, says, 2 * WIDTH if columns > 1 else WIDTH, each * rows, rows, columns, paint
    )


def _shape(ax: Any, geometry: Geometry, view: View, found: ShapeComparison, k: int) -> None:
    """Paired mode ``k``: the model's shape displaced, the measured motion at the sensors."""
    if found.model_shapes is None:
        return
    c = found.correlation
    model, measured = np.real(found.model_shapes[:, :, k]), np.real(c.shapes_measured[:, k])
    largest = max(float(np.abs(model).max()), float(np.nanmax(np.abs(measured), initial=0.0)))
    scale = REACH * extent(geometry) / max(largest, 1e-300)
    skeleton(ax, geometry, view, faint=True)
    skeleton(ax, geometry, view, moved=scale * model)
    ok = np.flatnonzero(np.isfinite(measured) & (found.kinds < 3))
    motion = np.zeros((len(ok), 3))
    motion[np.arange(len(ok)), found.kinds[ok]] = scale * measured[ok]
    here = geometry.xyz[found.nodes[ok]]
    a, b = view.project(here), displaced(view, here, motion)
    for p, q in zip(a, b, strict=True):
        ax.plot([p[0], q[0]], [p[1], q[1]], color=HELD, lw=0.8, alpha=0.7, zorder=4)
    ax.plot(b[:, 0], b[:, 1], "o", color=HELD, ms=3.2, mew=0, ls="", zorder=5)
    ax.set_title(
        f"mode {found.measured_number[k]}: {number(float(c.frequency_measured[k]))} "
        f"Hz, model {number(float(c.frequency_model[k]))} Hz, MAC "
        f"{fixed(float(c.pairing.mac[k]), 2)}",
        fontsize=8.5,
    )


def nominal_panels(name: str, compared: Compared) -> str | None:
    """The model's modes that were paired without shapes: plates by their nodal lines, other
    structures displaced."""
    geometry = compared.geometry
    if geometry is None or not drawable(geometry) or not compared.nominal:
        return None
    pairs = [m for m in compared.modes if m.mode in compared.nominal and m.mac is None][
        : 5 * COLUMNS
    ]
    areas = sum(len(p.nodes) > 2 for p in geometry.parts)
    flat = (
        areas > 0
        and np.ptp(geometry.xyz[:, 2]) == 0.0
        and not any(len(p.nodes) == 2 for p in geometry.parts)
    )
    pairs = pairs if flat else pairs[:MODES]
    view = view_of(
        geometry.xyz, np.array([False] * 3) if flat else np.asarray(geometry.moves.any(axis=0))
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
                nodal_lines(ax, geometry, motion[:, 2])
            else:
                skeleton(ax, geometry, view, faint=True)
                skeleton(
                    ax,
                    geometry,
                    view,
                    moved=REACH
                    * extent(geometry)
                    * motion
                    / max(float(np.abs(motion).max()), 1e-300),
                )
            ax.set_title(
                f"{number(m.measured)} Hz: mode {m.mode}, {number(m.model)} Hz",
                fontsize=7.5 if flat else 8.5,
            )
            _bare(ax, view)

    width = 2 * WIDTH
    each = _height(view, geometry, width / columns) * (0.8 if flat else 1.0) + 0.15
    return draw_panels(
        name,
        "Mode shapes of the model beside the measured frequencies they are paired with",
        width,
        each * rows,
        rows,
        columns,
        paint,
    )


def _moving(kinds: Real) -> NDArray[np.bool_]:
    return np.array([bool(np.any(kinds == k)) for k in range(3)])


def _percent(change: float) -> str:
    return f"{100 * change:+.0f} %".replace("-", "−")
