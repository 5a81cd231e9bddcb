"""Shapes in space: lengths, orientation vectors, rectangles, sheets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import text_of
from cvxupdate.spec.model import Node
from cvxupdate.spec.prepare import Complaint

ROUNDING = 1e-6
"""Relative error that coordinates may have from being written with few digits."""
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ZeroLength:
    """Rods, beams and two-node springs join two different nodes, rods and beams two different
    points."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every element without length."""
        for loc, block, row in case.rows():
            nodes = row.get("nodes", ())
            if len(nodes) > 1 and len(set(nodes)) < len(nodes):
                yield Complaint(
                    (*loc, "nodes"),
                    f"{block.type} {row.id} names a node twice: {list(nodes)}.",
                    "Name each node once; a spring to ground has one node only.",
                )
            elif (
                text_of(block).outline == "line"
                and len(nodes) == 2
                and all(n in case.nodes for n in nodes)
            ):
                a, b = (case.nodes[n] for n in nodes)
                if (a.x, a.y, a.z) == (b.x, b.y, b.z):
                    yield Complaint(
                        (*loc, "nodes"),
                        f"{block.type} {row.id} has no length: nodes {a.id} and {b.id} coincide.",
                        "Correct the coordinates, or join the nodes by a spring.",
                    )


@dataclass(frozen=True)
class Orientation:
    """An orientation vector is not parallel to its beam."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every orientation that gives no plane."""
        for loc, block, row in case.rows():
            if (
                row.get("orientation") is None
                or text_of(block).outline != "line"
                or not all(n in case.nodes for n in row.get("nodes"))
            ):
                continue
            axis = _unit(_between(*(case.nodes[n] for n in row.get("nodes"))))
            vector = _unit(row.get("orientation"))
            if axis is None:
                continue
            if vector is None or math.hypot(*_cross(axis, vector)) < ROUNDING:
                yield Complaint(
                    (*loc, "orientation"),
                    f"{block.type} {row.id}: {list(row.get('orientation'))} is zero or parallel to "
                    "the axis of the element.",
                    "Give a vector in the local x–z plane that leaves the axis.",
                )


@dataclass(frozen=True)
class SpinAxis:
    """A disc that spins says about which axis; a shaft has it from its nodes."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Discs without an axis, shafts with one."""
        for loc, _, row in case.rows():
            if "axis" not in type(row).model_fields:
                continue
            count, axis = len(row.get("nodes", ())), row.get("axis")
            if count == 2 and axis is not None:
                yield Complaint(
                    (*loc, "axis"),
                    f"gyroscopic {row.id} is a shaft: its axis runs from its first node to "
                    "its second.",
                    "Leave `axis` out.",
                )
            elif count == 1 and (axis is None or _unit(axis) is None):
                problem = f"gyroscopic {row.id} is a disc and " + (
                    "has no axis." if axis is None else "its axis has no length."
                )
                yield Complaint(
                    (*loc, "axis"), problem, "Give the axis it spins about, e.g. [1.0, 0.0, 0.0]."
                )


@dataclass(frozen=True)
class PlateShape:
    """A plate element is a rectangle in a plane of constant z, its nodes counter-clockwise seen
    from +z."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every plate that is not, with the order that would be right where one exists."""
        for loc, block, row in case.rows():
            nodes = row.get("nodes", ())
            if (
                text_of(block).outline != "rectangle"
                or len(set(nodes)) < 4
                or not all(n in case.nodes for n in nodes)
            ):
                continue
            corners = [case.nodes[n] for n in nodes]
            if _is_rectangle(corners):
                continue
            for order in ((0, 3, 2, 1), (0, 1, 3, 2), (0, 2, 1, 3), (0, 2, 3, 1), (0, 3, 1, 2)):
                if _is_rectangle([corners[i] for i in order]):
                    right = [nodes[i] for i in order]
                    yield Complaint(
                        (*loc, "nodes"),
                        f"{block.type} {row.id}: {list(nodes)} does not run counter-clockwise "
                        "(from +z).",
                        f"Write {right}.",
                    )
                    break
            else:
                yield Complaint(
                    (*loc, "nodes"),
                    f"{block.type} {row.id} is not a rectangle in a plane of constant z.",
                    "Correct the coordinates of its nodes, or mesh the surface with rectangles.",
                )


@dataclass(frozen=True)
class Outlines:
    """The nodes of a shell go around an area."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every element that its own type finds fault with."""
        for loc, block, row in case.rows():
            nodes = row.get("nodes", ())
            if len(set(nodes)) < len(nodes) or not all(n in case.nodes for n in nodes):
                continue
            at = (case.nodes[n] for n in nodes)
            flaw = text_of(block).flaw([(n.x, n.y, n.z) for n in at])
            if flaw is not None:
                problem, remedy = flaw
                yield Complaint((*loc, "nodes"), f"{block.type} {row.id} {problem}.", remedy)


@dataclass(frozen=True)
class StiffInShear:
    """A section with a shear coefficient stands on elements that deform in shear."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every rectangle whose section has `kappa`, said once for each section."""
        said: set[str] = set()
        for loc, block, row in case.rows():
            name = row.get("section")
            section = case.spec.model.sections.get(name)
            if text_of(block).outline != "rectangle" or section is None or name in said:
                continue
            said.add(name)
            if section.shape == "plate" and section.kappa is not None:
                yield Complaint(
                    (*loc, "section"),
                    f"{block.type} {row.id} does not deform in shear, but section '{name}' has "
                    "`kappa`.",
                    'Write type = "shell", or leave `kappa` out.',
                )


def _is_rectangle(corners: list[Node]) -> bool:
    a, b, c, d = corners
    u, v, w = _between(a, b), _between(a, d), _between(a, c)
    lu, lv, size = math.hypot(*u), math.hypot(*v), math.hypot(*w)
    slack = ROUNDING * size
    if not math.isfinite(size) or min(lu, lv) <= slack:
        return False
    closes = all(abs(w[i] - u[i] - v[i]) <= 4 * slack for i in range(3))
    unit_u, unit_v = _unit(u), _unit(v)
    if unit_u is None or unit_v is None:
        return False
    square = abs(
        sum(p * q for p, q in zip(unit_u, unit_v, strict=True))
    ) <= 4 * ROUNDING * size / min(lu, lv)
    flat = max(abs(u[2]), abs(v[2]), abs(w[2])) <= slack
    return closes and square and flat and _cross(unit_u, unit_v)[2] > 0


def _between(a: Node, b: Node) -> Vector:
    return (b.x - a.x, b.y - a.y, b.z - a.z)


def _unit(v: Vector) -> Vector | None:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length) if 0.0 < length < math.inf else None


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
