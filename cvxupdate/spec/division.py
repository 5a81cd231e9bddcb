"""How an element is divided into smaller ones of its type: the natural subdivision of its outline.

Points are given by the parent's shape functions, so the nodes of curved elements stay on the curve,
and elements that meet agree on the points that they share.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Children = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Division:
    """``weights`` (points, nodes): the parent's shape functions at every point, its own nodes
    first (rows of the identity); ``children``: numbers of points in the order of a row's nodes.

    A point lies on the edge or face whose nodes have weights other than zero; two elements share
    it where they give the same nodes the same weights.
    """

    weights: Real
    children: Children

    def key(self, point: int, nodes: Sequence[int]) -> frozenset[tuple[int, float]]:
        """What tells a point from others, for a parent on ``nodes``: node numbers and weights."""
        return frozenset(
            (node, round(float(w), 9))
            for node, w in zip(nodes, self.weights[point], strict=True)
            if abs(w) > 1e-9
        )


Divide = Callable[[int, int], Division | None]
"""(nodes of the row, parts along each edge) → how it is divided; None: it is not."""


def undivided(nodes: int, parts: int) -> None:
    """Elements that have no parts: springs, lumps, given matrices."""


def line(nodes: int, parts: int) -> Division | None:
    """Two nodes: ``parts`` equal lengths."""
    if nodes != 2:
        return None
    corners = [(0.0,), (1.0,)]
    ends = [(k / parts, (k + 1) / parts) for k in range(parts)]
    return number_children(
        corners, [[(a,), (b,)] for a, b in ends], lambda p: _multilinear(corners, p)
    )


def surface(nodes: int, parts: int) -> Division | None:
    """Three or four corners: ``parts`` along each side."""
    if nodes == 4:
        return _boxes([(0, 0), (1, 0), (1, 1), (0, 1)], parts)
    if nodes != 3:
        return None
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    children = []
    for i, j in itertools.product(range(parts), repeat=2):
        if i + j < parts:
            children.append([(i, j), (i + 1, j), (i, j + 1)])
        if i + j < parts - 1:
            children.append([(i + 1, j + 1), (i, j + 1), (i + 1, j)])
    cut = [[(x / parts, y / parts) for x, y in child] for child in children]
    return number_children(corners, cut, lambda p: [1.0 - p[0] - p[1], *p])


def _boxes(corners: Sequence[Sequence[int]], parts: int) -> Division:
    """A square or cube with corners at 0 and 1 and others between them, multilinear."""
    size = len(corners[0])
    children = [
        [tuple((c + o) / parts for c, o in zip(corner, origin, strict=True)) for corner in corners]
        for origin in itertools.product(range(parts), repeat=size)
    ]
    return number_children(corners, children, lambda p: _multilinear(corners, p))


def _multilinear(corners: Sequence[Sequence[float]], point: Sequence[float]) -> list[float]:
    return [
        float(np.prod([x if c else 1.0 - x for c, x in zip(corner, point, strict=True)]))
        for corner in corners
    ]


def number_children(
    own: Sequence[Sequence[float]],
    children: Sequence[Sequence[Sequence[float]]],
    shape: Callable[[Sequence[float]], Sequence[float]],
) -> Division:
    """The division into ``children``, given by the natural coordinates of their nodes, of a parent
    with nodes at ``own`` and shape functions ``shape``: points are numbered as they come."""

    def place(point: Sequence[float]) -> tuple[float, ...]:
        return tuple(round(float(x), 9) for x in point)

    number: dict[tuple[float, ...], int] = {place(p): k for k, p in enumerate(own)}
    points: list[Any] = list(own)
    rows = []
    for child in children:
        for p in child:
            if place(p) not in number:
                number[place(p)] = len(points)
                points.append(p)
        rows.append(tuple(number[place(p)] for p in child))
    weights = np.array([shape(p) for p in points], dtype=float)
    weights[np.abs(weights) < 1e-12] = 0.0
    weights[: len(own)] = np.eye(len(own))
    return Division(weights, tuple(rows))
