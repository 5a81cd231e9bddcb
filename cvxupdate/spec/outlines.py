"""What is wrong with the outline of an element, told from the places of its nodes alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

Point = tuple[float, float, float]
Flaw = tuple[str, str] | None
"""What is wrong, and the remedy."""
Inspect = Callable[[Sequence[Point]], Flaw]

ROUNDING = 1e-6
"""Relative error that coordinates may have from being written with few digits."""


def sound(points: Sequence[Point]) -> Flaw:
    """Outlines that other checks look at, or that there are none of."""
    return None


def sheet(points: Sequence[Point]) -> Flaw:
    """A triangle with an area, or a convex quadrilateral, seen along the normal of its diagonals;
    it may be warped."""
    a, b, c = points[:3]
    d = points[3] if len(points) == 4 else a
    normal = _cross(_between(a, c), _between(b, d))
    size = max(math.dist(p, a) for p in points)
    area = math.hypot(*normal)
    slack = ROUNDING * size**2
    if area <= slack:
        return "has no area", "Order its nodes around it, at different points."
    turns = [
        _dot(normal, _cross(_between(p, q), _between(q, r))) / area
        for p, q, r in zip(points, (*points[1:], a), (*points[2:], a, b), strict=True)
    ]
    if min(turns) > slack:
        return None
    return (
        "is not convex, or its nodes are not in order around it",
        "Order its nodes around it, or divide it into triangles.",
    )


def _between(a: Point, b: Point) -> Point:
    return (b[0] - a[0], b[1] - a[1], b[2] - a[2])


def _cross(a: Point, b: Point) -> Point:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: Point, b: Point) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
