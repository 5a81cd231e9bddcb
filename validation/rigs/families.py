"""Random drawings of each family, meshed as coarsely as an analyst would."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from validation.rigs.drawing import (
    Drawing,
    Generator,
    Line,
    Lump,
    Plate,
    Section,
    Spring,
)

METALS = ((210e9, 0.3, 7850.0), (70e9, 0.33, 2700.0), (205e9, 0.29, 7800.0))
Point = tuple[float, float, float]


def between(rng: Generator, low: float, high: float) -> float:
    """Even on a logarithmic scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def figures(x: float, digits: int = 3) -> float:
    """Rounded to so many digits, as a drawing gives it."""
    return float(f"{x:.{digits}g}")


def _metal(rng: Generator) -> tuple[float, float, float]:
    return METALS[int(rng.integers(len(METALS)))]


def _members(
    corners: dict[int, Point], members: Sequence[tuple[int, int, str, str, int]]
) -> tuple[dict[int, Point], tuple[Line, ...], tuple[tuple[int, int], ...]]:
    """Nodes, elements and joints of members (from, to, group, section, elements). Joints are the
    ends of members at corners where several meet."""
    nodes = dict(corners)
    lines: list[Line] = []
    ends: list[tuple[int, int]] = []
    for start, end, group, section, parts in members:
        a, b = (np.array(corners[n]) for n in (start, end))
        run = [start]
        for k in range(1, parts):
            number = len(nodes) + 1
            x, y, z = a + (b - a) * k / parts
            nodes[number] = (float(x), float(y), float(z))
            run.append(number)
        run.append(end)
        first = len(lines) + 1
        lines += [
            Line(first + k, (i, j), group, section)
            for k, (i, j) in enumerate(itertools.pairwise(run))
        ]
        ends += [(start, first), (end, len(lines))]
    meeting = [n for n, _ in ends]
    return nodes, tuple(lines), tuple(e for e in ends if meeting.count(e[0]) > 1)


def bar(rng: Generator, free: bool) -> Drawing:
    """A straight bar along x that bends in z: a cantilever or free; one to three groups."""
    E, nu, rho = _metal(rng)
    length, n = figures(rng.uniform(0.4, 2.0), 2), int(rng.integers(10, 15))
    height = figures(length / rng.uniform(25.0, 100.0), 2)
    section = Section.rectangle(figures(height * rng.uniform(1.0, 5.0), 2), height)
    pieces = int(rng.integers(1, 4))
    names = {1: ["bar"], 2: ["root", "tip"], 3: ["root", "middle", "tip"]}[pieces]
    nodes = {i + 1: (round(length * i / n, 6), 0.0, 0.0) for i in range(n + 1)}
    lines = tuple(Line(i + 1, (i + 1, i + 2), names[i * pieces // n], "bar") for i in range(n))
    held = () if free else ((1, "z"), (1, "ry"))
    family = "free beam" if free else "cantilever"
    return Drawing(family, ("z", "ry"), nodes, E, nu, rho, {"bar": section}, lines, held=held)


def portal(rng: Generator) -> Drawing:
    """Two columns and a beam in x–y, clamped feet."""
    E, nu, rho = _metal(rng)
    height, width = figures(rng.uniform(0.5, 3.0), 2), figures(rng.uniform(0.6, 4.0), 2)
    side = figures(height / rng.uniform(18.0, 40.0), 2)
    column = Section.hollow(side, figures(side * rng.uniform(0.05, 0.12), 2))
    other = figures(side * rng.uniform(0.7, 1.2), 2)
    beam = Section.hollow(other, figures(other * rng.uniform(0.05, 0.12), 2))
    n = int(rng.integers(5, 10))
    corners = {1: (0.0, 0.0, 0.0), 2: (width, 0.0, 0.0)}
    corners |= {3: (0.0, height, 0.0), 4: (width, height, 0.0)}
    nodes, lines, joints = _members(
        corners,
        [
            (1, 3, "left column", "column", n),
            (3, 4, "beam", "beam", n),
            (4, 2, "right column", "column", n),
        ],
    )
    held = tuple((f, k) for f in (1, 2) for k in ("x", "y", "rz"))
    return Drawing(
        "portal",
        ("x", "y", "rz"),
        nodes,
        E,
        nu,
        rho,
        {"column": column, "beam": beam},
        lines,
        held=held,
        joints=joints,
        rotary=bool(rng.random() < 0.7),
    )


def frame(rng: Generator) -> Drawing:
    """Two or three storeys, one or two bays, in x–y."""
    E, nu, rho = _metal(rng)
    storeys, bays = int(rng.integers(2, 4)), int(rng.integers(1, 3))
    width, height = figures(rng.uniform(0.4, 3.0), 2), figures(rng.uniform(0.3, 2.5), 2)
    side = figures(min(width, height) / rng.uniform(14.0, 30.0), 2)
    sections = {
        "column": Section.hollow(side, figures(side * rng.uniform(0.06, 0.12), 2)),
        "beam": Section.hollow(figures(0.8 * side, 2), figures(side * rng.uniform(0.05, 0.1), 2)),
    }
    across = bays + 1
    corners = {
        1 + c + s * across: (c * width, s * height, 0.0)
        for s in range(storeys + 1)
        for c in range(across)
    }
    members = []
    for s in range(storeys):
        members += [
            (1 + c + s * across, 1 + c + (s + 1) * across, f"columns {s + 1}", "column", 4)
            for c in range(across)
        ]
        members += [
            (1 + c + (s + 1) * across, 2 + c + (s + 1) * across, f"beams {s + 1}", "beam", 4)
            for c in range(bays)
        ]
    nodes, lines, joints = _members(corners, members)
    held = tuple((f, k) for f in range(1, across + 1) for k in ("x", "y", "rz"))
    return Drawing(
        "frame",
        ("x", "y", "rz"),
        nodes,
        E,
        nu,
        rho,
        sections,
        lines,
        held=held,
        joints=joints,
        rotary=bool(rng.random() < 0.7),
    )


def space(rng: Generator) -> Drawing:
    """A table of round tubes: four legs, four rails."""
    E, nu, rho = _metal(rng)
    a, b, h = (figures(rng.uniform(0.4, 1.5), 2) for _ in range(3))
    diameter = figures(min(a, b, h) / rng.uniform(14.0, 25.0), 2)
    sections = {
        "leg": Section.tube(diameter, figures(diameter * rng.uniform(0.06, 0.15), 2)),
        "rail": Section.tube(figures(0.9 * diameter, 2), figures(0.09 * diameter, 2)),
    }
    plan = ((0.0, 0.0), (a, 0.0), (a, b), (0.0, b))
    corners = {i + 1: (x, y, 0.0) for i, (x, y) in enumerate(plan)}
    corners |= {i + 5: (x, y, h) for i, (x, y) in enumerate(plan)}
    members = [(i + 1, i + 5, "legs", "leg", 4) for i in range(4)]
    sides = ("rails x", "rails y", "rails x", "rails y")
    members += [(5 + i, 5 + (i + 1) % 4, sides[i], "rail", 4) for i in range(4)]
    nodes, lines, joints = _members(corners, members)
    dofs = ("x", "y", "z", "rx", "ry", "rz")
    held = tuple((f, k) for f in range(1, 5) for k in dofs)
    return Drawing(
        "space frame", dofs, nodes, E, nu, rho, sections, lines, held=held, joints=joints
    )


def plate(rng: Generator) -> Drawing:
    """A cantilever plate, free, or on its four corners; thin to moderately thick."""
    E, nu, rho = _metal(rng)
    a = figures(rng.uniform(0.3, 1.2), 2)
    b = figures(a * rng.uniform(0.55, 0.95), 2)
    h = figures(b / between(rng, 15.0, 150.0), 2)
    nx, ny = int(rng.integers(8, 11)), int(rng.integers(6, 9))
    split = int(rng.integers(3, nx - 2)) if rng.random() < 0.4 else nx
    names = tuple("plate" if split == nx else "near" if i < split else "far" for i in range(nx))
    how = int(rng.integers(3))
    p = Plate(a, b, h, nx, ny, names, how == 0)
    nodes = {
        p.node(i, j): (round(a * i / nx, 6), round(b * j / ny, 6), 0.0)
        for j in range(ny + 1)
        for i in range(nx + 1)
    }
    held: tuple[tuple[int, str], ...] = ()
    if how == 0:
        held = tuple((p.node(0, j), k) for j in range(ny + 1) for k in ("z", "rx", "ry"))
    elif how == 1:
        held = tuple((n, "z") for n in (1, nx + 1, p.node(0, ny), p.node(nx, ny)))
    return Drawing("plate", ("z", "rx", "ry"), nodes, E, nu, rho, plate=p, held=held)


def chain(rng: Generator) -> Drawing:
    """Five to ten masses in a row on one or two soft supports."""
    n = int(rng.integers(5, 11))
    k, m = between(rng, 5e4, 2e6), between(rng, 0.5, 20.0)
    springs = [
        Spring(101 + i, (i, i + 1), "x", figures(k * rng.uniform(0.7, 1.4)), f"spring {i}")
        for i in range(1, n)
    ]
    soft = [1, n] if rng.random() < 0.5 else [1]
    springs += [
        Spring(191 + i, (at,), "x", figures(k * between(rng, 0.15, 1.0)), f"support {i + 1}")
        for i, at in enumerate(soft)
    ]
    lumps = tuple(
        Lump(201 + i, i, figures(m * rng.uniform(0.7, 1.4)), f"mass {i}") for i in range(1, n + 1)
    )
    nodes = {i: (float(i), 0.0, 0.0) for i in range(1, n + 1)}
    return Drawing("chain", ("x",), nodes, springs=tuple(springs), lumps=lumps)


FAMILIES = ("cantilever", "free beam", "portal", "frame", "space frame", "plate", "chain")


def draw(rng: Generator, family: str) -> Drawing:
    """A drawing of a family."""
    if family in ("cantilever", "free beam"):
        return bar(rng, family == "free beam")
    makers = {"portal": portal, "frame": frame, "space frame": space, "plate": plate}
    return makers.get(family, chain)(rng)
