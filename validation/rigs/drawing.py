"""A drawing: what the analyst's problem file says of a structure. The truth starts from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

Generator = np.random.Generator
TRANSLATIONS = ("x", "y", "z")


@dataclass(frozen=True)
class Section:
    """A bar's section; ``shape`` are its keys in a problem file."""

    A: float
    Iy: float
    Iz: float
    J: float
    shape: Mapping[str, float | str]

    @staticmethod
    def rectangle(width: float, height: float) -> Section:
        """Width along local y, height along local z; J by Roark's series for a solid bar."""
        a, b = max(width, height) / 2.0, min(width, height) / 2.0
        J = a * b**3 * (16.0 / 3.0 - 3.36 * b / a * (1.0 - b**4 / (12.0 * a**4)))
        return Section(
            width * height,
            width * height**3 / 12.0,
            height * width**3 / 12.0,
            J,
            {"shape": "rectangle", "width": width, "height": height},
        )

    @staticmethod
    def tube(diameter: float, wall: float) -> Section:
        """A round tube."""
        inner = diameter - 2.0 * wall
        inertia = np.pi * (diameter**4 - inner**4) / 64.0
        return Section(
            np.pi * (diameter**2 - inner**2) / 4.0,
            inertia,
            inertia,
            2.0 * inertia,
            {"shape": "circle", "diameter": diameter, "wall": wall},
        )

    @staticmethod
    def hollow(side: float, wall: float) -> Section:
        """A square hollow section, sharp corners, given by its numbers for a plane frame."""
        inner = side - 2.0 * wall
        A, inertia = side**2 - inner**2, (side**4 - inner**4) / 12.0
        return Section(
            A,
            inertia,
            inertia,
            (side - wall) ** 3 * wall,
            {"shape": "general", "A": float(f"{A:.5g}"), "Iz": float(f"{inertia:.5g}")},
        )


@dataclass(frozen=True)
class Line:
    """A beam element of the analyst's mesh."""

    id: int
    nodes: tuple[int, int]
    group: str
    section: str


@dataclass(frozen=True)
class Spring:
    """A spring of the analyst's model: one node is to ground."""

    id: int
    nodes: tuple[int, ...]
    dof: str
    k: float
    group: str


@dataclass(frozen=True)
class Lump:
    """A mass of the analyst's model."""

    id: int
    node: int
    m: float
    group: str


@dataclass(frozen=True)
class Plate:
    """A rectangle a × b of thickness h in nx × ny elements; nodes and elements are numbered from 1
    along x first; ``groups`` names the group of each column of elements; ``edge`` says whether the
    edge x = 0 is clamped."""

    a: float
    b: float
    h: float
    nx: int
    ny: int
    groups: tuple[str, ...]
    edge: bool

    def node(self, i: int, j: int) -> int:
        """Number of the node in column i, row j."""
        return 1 + i + j * (self.nx + 1)

    def element(self, i: int, j: int) -> int:
        """Number of the element in column i, row j."""
        return 1 + i + j * self.nx

    def corners(self, i: int, j: int) -> tuple[int, int, int, int]:
        """Nodes of an element, counter-clockwise."""
        return self.node(i, j), self.node(i + 1, j), self.node(i + 1, j + 1), self.node(i, j + 1)


@dataclass(frozen=True)
class Drawing:
    """A structure as an analyst models it. ``joints`` are the places where members meet: (node,
    end element); ``feet`` the nodes that are clamped or pinned to the ground."""

    family: str
    dofs: tuple[str, ...]
    nodes: Mapping[int, tuple[float, float, float]]
    E: float = 0.0
    nu: float = 0.3
    rho: float = 0.0
    sections: Mapping[str, Section] = field(default_factory=dict)
    lines: tuple[Line, ...] = ()
    springs: tuple[Spring, ...] = ()
    lumps: tuple[Lump, ...] = ()
    plate: Plate | None = None
    held: tuple[tuple[int, str], ...] = ()
    joints: tuple[tuple[int, int], ...] = ()
    rotary: bool = True

    @property
    def feet(self) -> tuple[int, ...]:
        """Nodes that are held."""
        return tuple(dict.fromkeys(n for n, _ in self.held))

    @property
    def free(self) -> bool:
        """Whether nothing holds it: it hangs on cords."""
        return not self.held and not any(len(s.nodes) == 1 for s in self.springs)

    def length(self, line: Line) -> float:
        """Of an element, m."""
        i, j = (np.array(self.nodes[n]) for n in line.nodes)
        return float(np.linalg.norm(j - i))

    def connections(self) -> dict[int, tuple[int, ...]]:
        """The nodes of every element that has more than one, springs to ground included."""
        members: tuple[Line | Spring, ...] = (*self.lines, *self.springs)
        out: dict[int, tuple[int, ...]] = {e.id: e.nodes for e in members}
        if self.plate is not None:
            p = self.plate
            for j in range(p.ny):
                out |= {p.element(i, j): p.corners(i, j) for i in range(p.nx)}
        return out

    def groups(self) -> dict[str, list[int]]:
        """Elements of each group."""
        out: dict[str, list[int]] = {}
        members: tuple[Line | Spring | Lump, ...] = (*self.lines, *self.springs, *self.lumps)
        for e in members:
            out.setdefault(e.group, []).append(e.id)
        if self.plate is not None:
            p = self.plate
            for j in range(p.ny):
                for i in range(p.nx):
                    out.setdefault(p.groups[i], []).append(p.element(i, j))
        return out

    def beside(self, nodes: Iterable[int]) -> list[int]:
        """Nodes that share an element with these, these left out."""
        mine = set(nodes)
        near = {n for c in self.connections().values() if mine & set(c) for n in c}
        return sorted(near - mine)

    def touching(self, nodes: Iterable[int]) -> list[int]:
        """Elements at these nodes."""
        mine = set(nodes)
        return sorted(e for e, c in self.connections().items() if mine & set(c))

    def nodes_of(self, elements: Iterable[int]) -> list[int]:
        """Nodes of these elements."""
        c = self.connections()
        return sorted({n for e in elements for n in c.get(e, ())})

    def mass(self) -> float:
        """Of the whole, kg."""
        m = sum(x.m for x in self.lumps)
        m += sum(self.rho * self.sections[e.section].A * self.length(e) for e in self.lines)
        return m + (0.0 if self.plate is None else self.rho * _volume(self.plate))

    def places(self) -> list[tuple[int, str]]:
        """(node, dof) of translations that can move."""
        held = set(self.held)
        return [
            (n, d)
            for n in self.nodes
            for d in self.dofs
            if d in TRANSLATIONS and (n, d) not in held
        ]


def _volume(p: Plate) -> float:
    return p.a * p.b * p.h
