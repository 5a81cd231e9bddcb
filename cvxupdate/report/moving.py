"""Mode shapes that move: SVG with SMIL animation, no script. The structure at rest is drawn
faintly; places in between follow the measured ones along the elements."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.structure import REACH, displaced, drawable, extent
from cvxupdate.report.views import View, view_of

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry

Real = NDArray[Any]
WIDTH = 320.0
PHASES = 12
"""Pictures of one period; between them places move along straight lines."""
SECONDS = 2.4
HEIGHTS = (70.0, 300.0)
MOST_NODES = 3000
MEASURED = 'stroke="var(--ink)" stroke-width="1.4"'
BEFORE = 'stroke="var(--before)" stroke-width="1.4" stroke-dasharray="5 3"'
AFTER = 'stroke="var(--after)" stroke-width="1.6"'
DOTS, DIAMOND = 'fill="var(--ink)"', "m-3 0l3-3 3 3-3 3z"
"""Measured is always the ink of the page, the model before grey, after blue."""


@dataclass(frozen=True)
class Motion:
    """Measured motion of one mode: ``rows`` (n,) of the geometry's nodes, ``kinds`` (n,) 0..2 for
    x..z, ``values`` (n,) complex."""

    rows: tuple[int, ...]
    kinds: tuple[int, ...]
    values: Real


def filled(geometry: Geometry, motion: Motion) -> Real:
    """Motion (nodes, 3) of every node, complex: as measured where it was, and elsewhere a mean of
    the neighbours along the elements, weighted by one over their distance (a string through the
    measured places: no stiffness of the model enters). Directions that were measured nowhere stand
    still, and so do parts that no element joins to a measured place."""
    n = len(geometry.node_ids)
    out = np.zeros((n, 3), dtype=np.complex128)
    laplacian = _laplacian(geometry)
    for kind in range(3):
        mine = [i for i, k in enumerate(motion.kinds) if k == kind]
        if not mine:
            continue
        known = np.array([motion.rows[i] for i in mine])
        held = np.flatnonzero(~geometry.moves[:, kind])
        fixed = np.unique(np.concatenate([known, held]))
        values = np.zeros(n, dtype=np.complex128)
        values[known] = motion.values[mine]
        free = np.setdiff1d(np.arange(n), fixed)
        if free.size:
            inner = laplacian[np.ix_(free, free)] + 1e-9 * np.eye(free.size)
            values[free] = np.linalg.solve(inner, -laplacian[np.ix_(free, fixed)] @ values[fixed])
        out[:, kind] = values
    return out


def _laplacian(geometry: Geometry) -> Real:
    n = len(geometry.node_ids)
    out = np.zeros((n, n))
    for part in geometry.parts:
        nodes = part.nodes
        ring = zip(nodes, (*nodes[1:], nodes[0]), strict=True) if len(nodes) > 2 else [nodes[:2]]
        for pair in ring:
            if len(pair) < 2:
                continue
            i, j = pair
            length = float(np.linalg.norm(geometry.xyz[i] - geometry.xyz[j]))
            w = 1.0 / max(length, 1e-9 * extent(geometry))
            out[i, i] += w
            out[j, j] += w
            out[i, j] -= w
            out[j, i] -= w
    scale = float(np.abs(out).max(initial=0.0))
    return out / scale if scale > 0.0 else out


def moving_shape(geometry: Geometry, motion: Motion, says: str) -> str | None:
    """One measured mode as an SVG element; None where there is nothing to draw, or too much."""
    if not drawable(geometry) or not motion.rows or len(geometry.node_ids) > MOST_NODES:
        return None
    whole = filled(geometry, motion)
    return _moving(geometry, [(whole, MEASURED)], (sorted(set(motion.rows)), whole), says)


def moving_pair(
    geometry: Geometry,
    before: Real | None,
    after: Real | None,
    motion: tuple[tuple[int, int, complex], ...],
    says: str,
) -> str | None:
    """The model's shape before and after, each (nodes, 3), and on them what was measured: (row of
    the geometry, 0..2 for x..z, value). None where there is nothing to draw, or too much."""
    if not drawable(geometry) or len(geometry.node_ids) > MOST_NODES:
        return None
    shapes = [(s, style) for s, style in ((before, BEFORE), (after, AFTER)) if s is not None]
    tops = [float(np.abs(s).max()) for s, _ in shapes]
    if not shapes or min(tops) == 0.0:
        return None
    dots = np.zeros((len(geometry.node_ids), 3), dtype=np.complex128)
    for row, kind, value in motion:
        dots[row, kind] = value / tops[-1]  # on the scale of the last
    rows = sorted({row for row, _, _ in motion})
    layers = [(s / top, style) for (s, style), top in zip(shapes, tops, strict=True)]
    return _moving(geometry, layers, (rows, dots), says)


def _moving(
    geometry: Geometry,
    layers: Sequence[tuple[Real, str]],
    marked: tuple[list[int], Real],
    says: str,
) -> str | None:
    """Shapes (nodes, 3) with the style of their lines, and dots at some nodes with their own."""
    top = max(float(np.abs(shape).max()) for shape, _ in layers)
    if top == 0.0:
        return None
    scale = REACH * extent(geometry) / top
    rows, dots = marked
    every = [*(shape for shape, _ in layers), dots]
    moves = np.array([any(bool(np.any(np.abs(s[:, k]) > 0.0)) for s in every) for k in range(3)])
    view = view_of(geometry.xyz, moves)
    phases = np.exp(2j * np.pi * np.arange(PHASES + 1) / PHASES)
    forms = [
        [displaced(view, geometry.xyz, np.real(shape * (scale * p))) for p in phases]
        for shape in every
    ]
    rest = view.project(geometry.xyz)
    if view.aside:
        rest = np.column_stack([rest[:, 0], np.zeros(len(rest))])
    place = _Place(np.concatenate([rest, *(f for form in forms for f in form)]))
    lines = [p.nodes for p in geometry.parts if len(p.nodes) > 1]
    body = [
        f'<path d="{place.path(rest, lines)}" fill="none" stroke="var(--line)" stroke-width="1"/>'
    ]
    body += [
        _animated([place.path(f, lines) for f in form], f'fill="none" {style}')
        for form, (_, style) in zip(forms, layers, strict=False)
    ]
    if rows:
        body.append(_animated([place.dots(f, rows) for f in forms[-1]], DOTS))
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {place.height:.0f}" role="img" '
        f'aria-label="{html.escape(says, quote=True)}">{"".join(body)}</svg>'
    )


def _animated(paths: Sequence[str], style: str) -> str:
    """A path through its forms; print and readers without animation see the first."""
    return (
        f'<path d="{paths[0]}" {style}><animate attributeName="d" dur="{SECONDS:g}s" '
        f'repeatCount="indefinite" values="{";".join(paths)}"/></path>'
    )


class _Place:
    """From the plane of the view to the figure."""

    def __init__(self, points: Real) -> None:
        low, high = points.min(axis=0), points.max(axis=0)
        span = np.maximum(high - low, 1e-12 * float(np.abs(high - low).max()))
        self.scale = min((WIDTH - 16.0) / float(span[0]), (HEIGHTS[1] - 16.0) / float(span[1]))
        self.height = max(HEIGHTS[0], self.scale * float(span[1]) + 16.0)
        self.middle, self.low = 0.5 * (low + high), low

    def at(self, p: Real) -> str:
        x = 0.5 * WIDTH + self.scale * float(p[0] - self.middle[0])
        y = 0.5 * self.height - self.scale * float(p[1] - self.middle[1])
        return f"{x:.1f} {y:.1f}"

    def path(self, points: Real, lines: Sequence[tuple[int, ...]]) -> str:
        return "".join(
            "M" + "L".join(self.at(points[n]) for n in nodes) + ("Z" if len(nodes) > 2 else "")
            for nodes in lines
        )

    def dots(self, points: Real, rows: Sequence[int]) -> str:
        return "".join(f"M{self.at(points[n])}{DIAMOND}" for n in rows)


__all__ = ["Motion", "View", "filled", "moving_pair", "moving_shape"]
