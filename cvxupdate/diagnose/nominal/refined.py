"""A model of a problem file on a finer mesh: line elements divided, plate elements quartered."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cvxupdate.diagnose.types import Real
from cvxupdate.spec import elements as se
from cvxupdate.spec import model as sm

Parts = Callable[[Any, Any], int]


def halved(block: Any, row: Any) -> int:
    """Every line element in two."""
    return 2


def refined(model: sm.Model, parts: Parts = halved, renumber: bool = False) -> sm.Model:
    """Line elements in ``parts(block, row)`` equal ones, every plate element quartered. Groups and
    sections stay; new nodes are held where the nodes of their rim are, or all nodes of the file.

    The parts of an element keep its number, as a set; with ``renumber`` the first one alone does,
    and the others get numbers above all.
    """
    mesh = _Mesh.of(model)
    top = max((row.id for block in model.elements for row in block.rows), default=0)
    blocks: list[Any] = []
    for block in model.elements:
        rows: list[Any] = []
        for row in block.rows:
            pieces = mesh.pieces(row, parts(block, row) if isinstance(row, se.LineRow) else 2)
            for k, nodes in enumerate(pieces):
                top += renumber and k > 0
                number = top if renumber and k else row.id
                rows.append(row.model_copy(update={"id": number, "nodes": nodes}))
            rows += [] if pieces else [row]
        blocks.append(block.model_copy(update={"rows": tuple(rows)}))
    return model.model_copy(
        update={
            "nodes": tuple(mesh.nodes),
            "elements": tuple(blocks),
            "supports": tuple(mesh.supports),
        }
    )


@dataclass
class _Mesh:
    """Nodes and supports as they grow: places ``xyz``, kinds ``held`` at each node; ``rim``: how
    many plate elements share an edge; ``everywhere``: kinds that supports hold at every node by
    number (a plane structure in space); ``between``: nodes that were made, shared by the elements
    that meet there."""

    xyz: dict[int, Real]
    held: dict[int, frozenset[str]]
    rim: dict[frozenset[int], int]
    everywhere: frozenset[str]
    top: int
    nodes: list[sm.Node]
    supports: list[sm.Support]
    between: dict[tuple[frozenset[int], float], int] = field(default_factory=dict)

    @classmethod
    def of(cls, model: sm.Model) -> _Mesh:
        """As the file has it."""
        held: dict[int, frozenset[str]] = {n.id: frozenset() for n in model.nodes}
        for s in model.supports:
            for n in held if s.nodes == "all" else s.nodes:
                held[n] = held.get(n, frozenset()) | set(s.dofs)
        whole = {d for s in model.supports if s.nodes == "all" for d in s.dofs}
        everywhere = frozenset.intersection(*held.values()) - whole if held else frozenset()
        xyz = {n.id: np.array([n.x, n.y, n.z]) for n in model.nodes}
        top = max(xyz, default=0)
        return cls(xyz, held, _rim(model), everywhere, top, list(model.nodes), list(model.supports))

    def pieces(self, row: Any, parts: int) -> list[tuple[int, ...]]:
        """Nodes of the parts of an element; none where it is not divided."""
        if isinstance(row, se.LineRow):
            a, b = row.nodes
            ends = [a, *(self._node((a, b), k / parts) for k in range(1, parts)), b]
            return list(itertools.pairwise(ends))
        if isinstance(row, se.PlateRow):
            a, b, c, d = row.nodes
            edges = ((a, b), (b, c), (c, d), (d, a))
            ab, bc, cd, da = (self._node(e, 0.5, self.rim[frozenset(e)] == 1) for e in edges)
            o = self._node((a, b, c, d), 0.5)
            return [(a, ab, o, da), (ab, b, bc, o), (o, bc, c, cd), (da, o, cd, d)]
        return []

    def _node(self, ids: tuple[int, ...], part: float, rim: bool = False) -> int:
        """The node between two others at a fraction of the way, or amid more; on a ``rim`` held as
        both its ends are."""
        key = frozenset(ids), round(part if ids[0] == min(ids) else 1.0 - part, 9)
        if key in self.between:
            return self.between[key]
        xyz = [self.xyz[i] for i in ids]
        at = xyz[0] + (xyz[1] - xyz[0]) * part if len(ids) == 2 else np.mean(xyz, axis=0)
        self.top += 1
        self.between[key] = self.top
        self.nodes.append(sm.Node(id=self.top, x=float(at[0]), y=float(at[1]), z=float(at[2])))
        held = frozenset.intersection(*(self.held.get(i, frozenset()) for i in ids))
        dofs = tuple(sorted((held if rim else frozenset()) | self.everywhere))
        if dofs:
            self.supports.append(sm.Support(nodes=(self.top,), dofs=dofs))  # type: ignore[arg-type]
        return self.top


def _rim(model: sm.Model) -> dict[frozenset[int], int]:
    """How many plate elements share an edge: 1 on the rim."""
    plates = [r for block in model.elements for r in block.rows if isinstance(r, se.PlateRow)]
    edges = (frozenset((r.nodes[i], r.nodes[(i + 1) % 4])) for r in plates for i in range(4))
    return dict(Counter(edges))
