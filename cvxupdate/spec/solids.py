"""Bricks and tetrahedra by their natural coordinates: places of the nodes, shape functions, faces,
division into smaller ones, and what may be wrong with one."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cvxupdate.spec.division import Division, Real, number_children
from cvxupdate.spec.outlines import ROUNDING, Flaw, Point

_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_SQUARE_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))
_CUBE_EDGES = (
    *_SQUARE_EDGES,
    *((i + 4, j + 4) for i, j in _SQUARE_EDGES),
    *((i, i + 4) for i in range(4)),
)
_TET = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
CUBE_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))


@dataclass(frozen=True)
class Solid:
    """``corners`` and ``edges`` of a solid; ``quadratic``: with a node amid every edge, after the
    corners. ``powers`` (nodes, 3) of the monomials that the shape functions are made of."""

    corners: tuple[tuple[int, int, int], ...]
    edges: tuple[tuple[int, int], ...]
    faces: tuple[tuple[int, ...], ...]
    quadratic: bool
    powers: tuple[tuple[int, int, int], ...]

    @property
    def places(self) -> Real:
        """Natural coordinates of the nodes, (nodes, 3), between 0 and 1."""
        return _with_middles(np.array(self.corners, dtype=float), self)

    def shape(self, points: Real, derivative: int | None = None) -> Real:
        """Shape functions at ``points`` (p, 3), (p, nodes), or their derivatives along a natural
        axis."""
        return np.asarray(_monomials(points, self.powers, derivative) @ _inverse(self))


def _with_middles(corners: Real, solid: Solid) -> Real:
    i, j = np.array(solid.edges).T
    return np.vstack([corners, (corners[i] + corners[j]) / 2.0]) if solid.quadratic else corners


def _monomials(points: Real, powers: Sequence[Sequence[int]], derivative: int | None) -> Real:
    columns = []
    for power in powers:
        factor, exponents = 1.0, list(power)
        if derivative is not None:
            factor = float(exponents[derivative])
            exponents[derivative] = max(exponents[derivative] - 1, 0)
        columns.append(factor * np.prod(points ** np.array(exponents), axis=1))
    return np.stack(columns, axis=1)


@lru_cache(maxsize=8)
def _inverse(solid: Solid) -> Real:
    return np.asarray(np.linalg.inv(_monomials(solid.places, solid.powers, None)), dtype=float)


def _powers(top: int, kept: int, linear: bool) -> tuple[tuple[int, int, int], ...]:
    """Monomials up to ``top`` in each variable: with total degree ``kept``, or, where ``linear``,
    degree ``kept`` not counting variables that stand in them linearly (serendipity)."""
    found: list[tuple[int, int, int]] = []
    for a, b, c in itertools.product(range(top + 1), repeat=3):
        degree = sum(p for p in (a, b, c) if p > 1 or not linear)
        if degree <= kept:
            found.append((a, b, c))
    return tuple(found)


HEX8 = Solid(_CUBE, _CUBE_EDGES, CUBE_FACES, False, _powers(1, 0, True))
HEX20 = Solid(_CUBE, _CUBE_EDGES, CUBE_FACES, True, _powers(2, 2, True))
TET10 = Solid(_TET, _TET_EDGES, TET_FACES, True, _powers(2, 2, False))


def divide_brick(solid: Solid, parts: int) -> Division:
    """A brick in ``parts`` along each edge."""
    cube = np.array(_CUBE, dtype=float)
    corners = [
        (cube + np.array(origin)) / parts for origin in itertools.product(range(parts), repeat=3)
    ]
    return _divided(solid, corners)


def divide_tetrahedron(solid: Solid, parts: int) -> Division | None:
    """A tetrahedron in eight of equal volume, or those again, for ``parts`` a power of two: four at
    its corners, four around a diagonal of the octahedron between them (Bey 1995)."""
    if parts < 1 or parts & (parts - 1):
        return None
    corners = [np.array(_TET, dtype=float)]
    while parts > 1:
        corners = [child for parent in corners for child in _eight(parent)]
        parts //= 2
    return _divided(solid, corners)


def _eight(c: Real) -> list[Real]:
    m = {(i, j): (c[i] + c[j]) / 2.0 for i in range(4) for j in range(4)}
    corners = [[m[i, j] for j in range(4)] for i in range(4)]  # m[i, i] is corner i itself
    inner = [
        (m[0, 1], m[0, 2], m[0, 3], m[1, 3]),
        (m[0, 1], m[0, 2], m[1, 3], m[1, 2]),
        (m[0, 2], m[0, 3], m[1, 3], m[2, 3]),
        (m[0, 2], m[1, 2], m[2, 3], m[1, 3]),
    ]
    return [_right_handed(np.array(child)) for child in (*corners, *inner)]


def _right_handed(c: Real) -> Real:
    return c if np.linalg.det(c[1:] - c[0]) > 0.0 else c[[0, 2, 1, 3]]


def _divided(solid: Solid, corners: Sequence[Real]) -> Division:
    children = [_with_middles(c, solid).tolist() for c in corners]
    return number_children(
        solid.places.tolist(), children, lambda p: solid.shape(np.array([p]))[0].tolist()
    )


def inspect(solid: Solid, points: Sequence[Point]) -> Flaw:
    """The number of nodes, and that every corner opens as it does in the reference."""
    count = len(solid.places)
    if len(points) != count:
        return f"has {len(points)} nodes", f"It needs {count}."
    xyz = np.array(points)
    size = float(np.ptp(xyz, axis=0).max())
    J = np.stack(
        [solid.shape(np.array(solid.corners, dtype=float), k) @ xyz for k in range(3)], axis=1
    )
    if np.all(np.linalg.det(J) > ROUNDING * size**3):
        return None
    return (
        "has no volume at a corner, or is turned inside out",
        "Order its nodes: the first face anticlockwise seen from the inside, then what lies above.",
    )
