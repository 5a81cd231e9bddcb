"""A model of a problem file on a finer mesh: the elements of the file divided, text to text."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cvxupdate.fe.edge_springs import divided_springs
from cvxupdate.fe.elements.spring import SpringRow
from cvxupdate.fe.terms import Real
from cvxupdate.spec import elements as se
from cvxupdate.spec import model as sm

Parts = Callable[[Any, Any], int]


def halved(block: Any, row: Any) -> int:
    """Every edge in two."""
    return 2


@dataclass(frozen=True)
class Made:
    """A node that was made: ``weights`` of the nodes of the file that it lies between, and how many
    sheets meet there where it is on an edge of theirs (1: the rim; 0: it is on none)."""

    weights: Mapping[int, float]
    sheets: int


@dataclass(frozen=True)
class Refined:
    """The finer ``model``, the nodes that were ``made``, by their numbers, and the numbers of the
    ``parts`` of each element of the file that was divided."""

    model: sm.Model
    made: Mapping[int, Made]
    parts: Mapping[int, tuple[int, ...]] = field(default_factory=dict)


def refined(model: sm.Model, parts: Parts = halved, renumber: bool = False) -> Refined:
    """Every element that can be divided in ``parts(block, row)`` along each edge. Groups and
    sections stay; new nodes are held where the nodes of their rim are, or all nodes of the file.

    The parts of an element keep its number, as a set; with ``renumber`` the first one alone does,
    and the others get numbers above all.
    """
    mesh = _Mesh.of(model)
    top = max((row.id for block in model.elements for row in block.rows), default=0)
    blocks: list[Any] = []
    parents: dict[int, tuple[int, ...]] = {}
    for block in model.elements:
        rows: list[Any] = []
        for row in block.rows:
            pieces = mesh.pieces(row, parts(block, row))
            for k, nodes in enumerate(pieces):
                top += renumber and k > 0
                number = top if renumber and k else row.id
                rows.append(row.model_copy(update={"id": number, "nodes": nodes}))
                parents[row.id] = (*parents.get(row.id, ()), number)
            rows += [] if pieces else [row]
        blocks.append(block.model_copy(update={"rows": tuple(rows)}))
    edges = [r for b in blocks for r in b.rows if isinstance(r, SpringRow) and r.edge]
    if edges:
        divided = divided_springs(edges, mesh.made, mesh.xyz, mesh.held)
        blocks = _with_springs(blocks, divided, top if renumber else None)
    text = model.model_copy(
        update={
            "nodes": tuple(mesh.nodes),
            "elements": tuple(blocks),
            "supports": tuple(mesh.supports),
        }
    )
    return Refined(text, mesh.made, parents)


def _with_springs(blocks: Sequence[Any], divided: Sequence[Any], top: int | None) -> list[Any]:
    """Blocks with the springs of edges ``divided``, numbered from ``top`` on where several would
    have the number of one."""
    by: dict[int, list[Any]] = {}
    out = []
    for row in divided:
        by.setdefault(row.id, []).append(row)
    for block in blocks:
        rows = []
        for row in block.rows:
            if not (isinstance(row, SpringRow) and row.edge):
                rows.append(row)
                continue
            for k, part in enumerate(by.get(row.id, ())):
                if top is not None and k:
                    top += 1
                    part = part.model_copy(update={"id": top})
                rows.append(part)
        out.append(block.model_copy(update={"rows": tuple(rows)}))
    return out


def held_kinds(model: sm.Model) -> dict[int, frozenset[str]]:
    """The kinds that supports hold at each node."""
    held: dict[int, frozenset[str]] = {n.id: frozenset() for n in model.nodes}
    for s in model.supports:
        for n in held if s.nodes == "all" else s.nodes:
            held[n] = held.get(n, frozenset()) | set(s.dofs)
    return held


def held_everywhere(model: sm.Model) -> frozenset[str]:
    """Kinds that supports hold at every node: a plane structure in space."""
    held = held_kinds(model)
    return frozenset.intersection(*held.values()) if held else frozenset()


def _division(row: Any, parts: int) -> tuple[Real, list[tuple[int, ...]]] | None:
    """(weights (points, nodes) of the parent's nodes, which come first; points of each child)."""
    if isinstance(row, se.LineRow):
        along = np.arange(1, parts) / parts
        weights = np.vstack([np.eye(2), np.stack([1.0 - along, along], axis=1)])
        order = [0, *range(2, parts + 1), 1]
        return weights, list(itertools.pairwise(order))
    if isinstance(row, se.PlateRow):
        return _grid(parts)
    return None


def _grid(parts: int) -> tuple[Real, list[tuple[int, ...]]]:
    """Of a quadrilateral, corners first."""
    corners = [(0, 0), (parts, 0), (parts, parts), (0, parts)]
    inside = [
        (i, j) for j in range(parts + 1) for i in range(parts + 1) if (i, j) not in set(corners)
    ]
    points = [*corners, *inside]
    number = {p: k for k, p in enumerate(points)}
    x, y = (np.array(points, dtype=float) / parts).T
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=1)
    children: list[tuple[int, ...]] = [
        tuple(number[p] for p in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
        for j in range(parts)
        for i in range(parts)
    ]
    return weights, children


@dataclass
class _Mesh:
    """Nodes and supports as they grow: places ``xyz``, kinds ``held`` at each node; ``rim``: how
    many sheets share an edge; ``everywhere``: kinds that supports hold at every node by number (a
    plane structure in space); ``between``: nodes that were made, shared by the elements that meet
    there."""

    xyz: dict[int, Real]
    held: dict[int, frozenset[str]]
    rim: dict[frozenset[int], int]
    everywhere: frozenset[str]
    top: int
    nodes: list[sm.Node]
    supports: list[sm.Support]
    between: dict[frozenset[tuple[int, float]], int] = field(default_factory=dict)
    made: dict[int, Made] = field(default_factory=dict)

    @classmethod
    def of(cls, model: sm.Model) -> _Mesh:
        """As the file has it."""
        whole = {d for s in model.supports if s.nodes == "all" for d in s.dofs}
        xyz = {n.id: np.array([n.x, n.y, n.z]) for n in model.nodes}
        return cls(
            xyz,
            held_kinds(model),
            _rim(model),
            held_everywhere(model) - whole,
            max(xyz, default=0),
            list(model.nodes),
            list(model.supports),
        )

    def pieces(self, row: Any, parts: int) -> list[tuple[int, ...]]:
        """Nodes of the parts of an element; none where it is not divided."""
        found = _division(row, parts)
        if found is None:
            return []
        weights, children = found
        points = [self._node(row.nodes, w) for w in weights]
        return [tuple(points[i] for i in child) for child in children]

    def _node(self, nodes: Sequence[int], weights: Real) -> int:
        """The node at ``weights`` of an element's nodes, made where there is none yet; on a rim it
        is held as all that it lies between are."""
        used = {n: float(w) for n, w in zip(nodes, weights, strict=True) if abs(w) > 1e-12}
        if len(used) == 1:
            return next(iter(used))
        key = frozenset((n, round(w, 9)) for n, w in used.items())
        if key in self.between:
            return self.between[key]
        at = sum((w * self.xyz[n] for n, w in used.items()), np.zeros(3))
        self.top += 1
        self.between[key] = self.top
        self.nodes.append(sm.Node(id=self.top, x=float(at[0]), y=float(at[1]), z=float(at[2])))
        sheets = self.rim.get(frozenset(used), 0)
        rim = sheets == 1
        self.made[self.top] = Made(used, sheets)
        held = frozenset.intersection(*(self.held.get(i, frozenset()) for i in used))
        dofs = tuple(sorted((held if rim else frozenset()) | self.everywhere))
        if dofs:
            self.supports.append(sm.Support(nodes=(self.top,), dofs=dofs))  # type: ignore[arg-type]
        return self.top


def _rim(model: sm.Model) -> dict[frozenset[int], int]:
    """How many sheets share an edge: 1 on the rim."""
    sheets = [r for block in model.elements for r in block.rows if isinstance(r, se.PlateRow)]
    edges = (frozenset((r.nodes[i], r.nodes[(i + 1) % 4])) for r in sheets for i in range(4))
    return dict(Counter(edges))
