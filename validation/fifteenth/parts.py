"""Structures and effects that several cases use."""

from __future__ import annotations

from typing import Any

from validation.fifteenth.shapes import DOFS, STEEL, Effect, Material, Member, Section, Structure

PLANE = ("x", "z", "ry")
E = Effect


def portal(
    span: float,
    height: float,
    col: Section,
    beam: Section,
    nc: int = 6,
    nb: int = 8,
    material: Material = STEEL,
    bays: int = 1,
    storeys: int = 1,
) -> Structure:
    """A plane portal frame, clamped feet."""
    s = Structure(dofs=PLANE)
    for i in range(bays + 1):
        for j in range(storeys + 1):
            s.points[f"p{i}{j}"] = (span * i, 0.0, height * j)
        s.held[f"p{i}0"] = DOFS
        for j in range(storeys):
            s.members.append(
                Member(f"col{i}{j}", f"p{i}{j}", f"p{i}{j + 1}", col, nc, "columns", material)
            )
    for i in range(bays):
        for j in range(storeys):
            s.members.append(
                Member(
                    f"beam{i}{j}", f"p{i}{j + 1}", f"p{i + 1}{j + 1}", beam, nb, "beams", material
                )
            )
    return s


def table(
    a: float,
    b: float,
    height: float,
    leg: Section,
    rail: Section,
    n: int = 4,
    storeys: int = 1,
    material: Material = STEEL,
) -> Structure:
    """Four legs and a ring of rails on every storey, in space, feet held."""
    s = Structure()
    corners = ((0.0, 0.0), (a, 0.0), (a, b), (0.0, b))
    for i, (x, y) in enumerate(corners):
        for j in range(storeys + 1):
            s.points[f"p{i}{j}"] = (x, y, round(height * j, 6))
        s.held[f"p{i}0"] = DOFS
        for j in range(storeys):
            s.members.append(
                Member(f"leg{i}{j}", f"p{i}{j}", f"p{i}{j + 1}", leg, n, "legs", material)
            )
    for i in range(4):
        for j in range(1, storeys + 1):
            s.members.append(
                Member(f"rail{i}{j}", f"p{i}{j}", f"p{(i + 1) % 4}{j}", rail, n, "rails", material)
            )
    return s


def line(
    points: list[float],
    sections: list[Section],
    n: list[int],
    groups: list[str],
    dofs: tuple[str, ...] = PLANE,
    material: Material = STEEL,
    upright: bool = False,
) -> Structure:
    """A straight bar of several pieces, along x or upright."""
    s = Structure(dofs=dofs)
    for i, x in enumerate(points):
        s.points[f"p{i}"] = (0.0, 0.0, x) if upright else (x, 0.0, 0.0)
    for i, sec in enumerate(sections):
        s.members.append(Member(f"bar{i}", f"p{i}", f"p{i + 1}", sec, n[i], groups[i], material))
    return s


def ladder(
    length: float,
    width: float,
    rungs: int,
    rail: Section,
    rung: Section,
    n: int = 3,
    material: Material = STEEL,
) -> Structure:
    """Two rails along x, and rungs; in space, lying."""
    s = Structure()
    for side, y in enumerate((0.0, width)):
        for i in range(rungs):
            s.points[f"p{side}{i}"] = (round(length * i / (rungs - 1), 6), y, 0.0)
        for i in range(rungs - 1):
            s.members.append(
                Member(
                    f"rail{side}{i}", f"p{side}{i}", f"p{side}{i + 1}", rail, n, "rails", material
                )
            )
    for i in range(rungs):
        s.members.append(Member(f"rung{i}", f"p0{i}", f"p1{i}", rung, 2, "rungs", material))
    return s


def feet(s: Structure, numbers: dict[str, float], says: str) -> list[Effect]:
    """The same foot under every support."""
    return [E("foot", p, dict(numbers), says) for p in s.held]


def joints(
    s: Structure, kr: float, groups: tuple[str, ...], says: str = "bolted joints give, all alike"
) -> list[Effect]:
    """Equal springs at both ends of the members of some groups."""
    return [
        E("joint", (m.name, end), {"kr": kr}, says)
        for m in s.members
        if m.group in groups
        for end in "ab"
    ]


def cords(places: list[Any], k: float, dofs: tuple[str, ...] = ("z",)) -> list[Effect]:
    """Soft springs to the ground."""
    return [E("cord", p, {"k": k, "dof": d}, "cord") for p in places for d in dofs]
