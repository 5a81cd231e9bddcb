"""Springs spread along edges of an analysis model: k ∫ N Nᵀ ds with the shapes of the edges.

Where supports along the edge of a sheet are set free, the edge is so between its nodes, too: what
holds it is spread over its length. N are the shapes by which its points follow the DOFs of its
nodes and its own coordinates (`cvxupdate.fe.analysis.edges`). What the support of one node gives
falls off to nothing at those beside it, in proportion, as the compliance of supports is read
between nodes: of all nodes alike it is that of every point.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from cvxupdate.fe.analysis.edges import Edge
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model

POINTS = 10  # of Gauss and Legendre: exact for products of shapes of the ninth degree
PARALLEL = 0.999  # cosine of an axis and an edge that is held about it
ALONG = 1e-6  # component of a direction that counts
KEPT = 512  # supports whose matrices are remembered: candidates are asked for beside every model
LEAST = 1e-6  # of the mean: what holds coordinates that leave the edge where it is
COORDINATE = re.compile(r"(?P<family>\w+) of (?P<a>\d+)-(?P<b>\d+) along (?P<axis>\S+)")


Support = tuple[int, str]  # node, kind


def spread(
    model: Model, labels: Sequence[str], held: Sequence[Support]
) -> tuple[Real, Real] | None:
    """Matrices (h, r, r) of the springs of supports ``held``, which were set free with DOFs and
    coordinates of edges ``labels`` (r,), and what each has (h,) of the average: by the length of
    edge that is its own. None where no edge has coordinates that move along with them."""
    met = {n for x in labels for n in ends_of(x)}
    place = {int(n): tuple(model.xyz[i].tolist()) for i, n in enumerate(model.node_ids) if n in met}
    return _spread(tuple(labels), tuple(held), tuple(place.items()))


def ends_of(label: str) -> tuple[int, ...]:
    """The nodes of the edge that it is a coordinate of; none of what is none."""
    told = COORDINATE.fullmatch(label)
    return () if told is None else (int(told["a"]), int(told["b"]))


@lru_cache(maxsize=KEPT)
def _spread(
    labels: tuple[str, ...],
    held: tuple[Support, ...],
    places: tuple[tuple[int, tuple[float, ...]], ...],
) -> tuple[Real, Real] | None:
    place = {n: np.array(x) for n, x in places}
    column = {x: j for j, x in enumerate(labels)}
    edges = _edges(place, labels)
    out, shares = np.zeros((len(held), len(labels), len(labels))), np.ones(len(held))
    found = False
    for kind in dict.fromkeys(k for _, k in held):
        rows = {n: i for i, (n, k) in enumerate(held) if k == kind}
        own = np.zeros(len(held))
        for edge, mine in edges:
            if {edge.a, edge.b} & set(rows) and _moves(edge, kind, mine):
                _add(out, own, edge, kind, rows, column)
        spanned = np.flatnonzero(own > 0.0)
        if len(spanned):
            found, mean = True, own[spanned].mean()
            out[spanned] /= mean
            shares[spanned] = own[spanned] / mean
        for n, i in rows.items():
            if own[i] == 0.0:
                j = column[f"n{n}.{kind}"]
                out[i, j, j] = 1.0
    if not found:
        return None
    out += LEAST * np.einsum("hrr->", out) / len(labels) / len(held) * np.eye(len(labels))
    return out, shares


def _edges(place: Mapping[int, Real], labels: Sequence[str]) -> list[tuple[Edge, frozenset[str]]]:
    """Those that ``labels`` are coordinates of, and which each has of them."""
    of: dict[tuple[int, ...], set[str]] = {}
    for label in labels:
        of.setdefault(ends_of(label), set()).add(label)
    out = []
    for (a, b), mine in (item for item in of.items() if item[0]):
        start, end = place[a], place[b]
        ruled = any(x.startswith("slope") for x in mine)
        out.append((Edge(a, b, start, end, turns=True, rim=True, ruled=ruled), frozenset(mine)))
    return out


def _moves(edge: Edge, kind: str, labels: frozenset[str]) -> bool:
    """Whether some of its coordinates do along or, as its own axis, about a direction."""
    axis = KINDS.index(kind)
    if axis >= 3:
        turns = any(x.startswith("twist") for x in labels)
        return turns and abs(float(edge.axes[0][axis - 3])) >= PARALLEL
    names = zip(edge.names, _labels(edge), strict=True)
    return any(
        x in labels and not name.startswith("twist") and abs(d[axis]) > ALONG
        for (name, d), x in names
    )


def _labels(edge: Edge) -> list[str]:
    return [coordinate(edge, family, d) for family, d in edge.names]


def coordinate(edge: Edge, family: str, direction: Real) -> str:
    """The label of one."""
    axis = ",".join(f"{x:.4f}" for x in direction + 0.0)
    return f"{family} of {edge.a}-{edge.b} along {axis}"


def _add(
    out: Real,
    own: Real,
    edge: Edge,
    kind: str,
    rows: dict[int, int],
    column: dict[str, int],
) -> None:
    """Its part of the springs of its ends, and of the length that they have."""
    axis, length = KINDS.index(kind), edge.axes[3]
    nodal = [
        (shift + j, column[x])
        for n, shift in ((edge.a, 0), (edge.b, 6))
        for j, word in enumerate(KINDS)
        if (x := f"n{n}.{word}") in column
    ]
    inner = [(j, column[x]) for j, x in enumerate(_labels(edge)) if x in column]
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    for x, w in zip((1.0 + points) / 2.0, weights * length / 2.0, strict=True):
        t = float(x)
        follows, further = edge.followed(t)[axis], edge.further(t)[axis]
        N = np.zeros(out.shape[1])
        for j, at in nodal:
            N[at] += follows[j]
        for j, at in inner:
            N[at] += further[j]
        part = {n: s for n, s in ((edge.a, 1.0 - t), (edge.b, t)) if n in rows}
        soft = sum(part.values())  # compliance here, of that of a support
        for n, s in part.items():
            out[rows[n]] += w * s / soft**2 * np.outer(N, N)
            own[rows[n]] += w * s
