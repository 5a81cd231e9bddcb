"""Numbers and names: unique where they are given, known where they are used."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import LineBlock, LineRow, MatrixRow, PlateBlock, PlateRow
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.words import nearest


@dataclass(frozen=True)
class DuplicateIds:
    """Node numbers and element numbers are unique."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every number that was used before."""
        seen: set[int] = set()
        for i, node in enumerate(case.spec.model.nodes):
            if node.id in seen:
                yield Complaint(
                    ("model", "nodes", i, "id"),
                    f"node {node.id} appears twice.",
                    "Give every node its own number.",
                )
            seen.add(node.id)
        seen = set()
        for loc, _, row in case.rows():
            if row.id in seen:
                yield Complaint(
                    (*loc, "id"),
                    f"element {row.id} appears twice.",
                    "Give every element its own number, across all blocks.",
                )
            seen.add(row.id)


@dataclass(frozen=True)
class ElementNodes:
    """Elements stand on nodes that exist."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every missing node of an element."""
        for loc, _, row in case.rows():
            for node in getattr(row, "nodes", ()):
                if not case.has_node(node):
                    yield Complaint(
                        (*loc, "nodes"),
                        f"element {row.id} stands on node {node}, which does not exist.",
                        "Add the node to model.nodes, or correct the number.",
                    )


@dataclass(frozen=True)
class Labels:
    """Labels of matrices are of the form n<node>.<dof>, once each, on nodes that exist."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every label that is not one, and every repeated one."""
        for loc, _, row in case.rows():
            if not isinstance(row, MatrixRow) or not isinstance(row.labels, tuple):
                continue
            if len(set(row.labels)) < len(row.labels):
                yield Complaint(
                    (*loc, "labels"),
                    f"element {row.id} names a DOF twice.",
                    "Give each row of the matrix its own label.",
                )
            for label in row.labels:
                if not re.fullmatch(r"n\d{1,10}\.r?[xyz]", label, re.ASCII):
                    yield Complaint(
                        (*loc, "labels"),
                        f"'{label}' is not a DOF label.",
                        'Write "n6.y": node 6, DOF y.',
                    )
                elif case.nodes and int(label[1:].split(".")[0]) not in case.nodes:
                    yield Complaint(
                        (*loc, "labels"),
                        f"'{label}' is at a node that does not exist.",
                        "Add the node to model.nodes, or leave model.nodes out.",
                    )
                elif label.split(".")[1] not in case.spec.model.dofs:
                    yield Complaint(
                        (*loc, "labels"), f"'{label}' is not active.", "Add its kind to model.dofs."
                    )


@dataclass(frozen=True)
class Materials:
    """Materials exist."""

    needs: ClassVar[tuple[str, ...]] = ("materials",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every unknown material."""
        known = case.spec.model.materials
        for loc, _, row in case.rows():
            if isinstance(row, LineRow | PlateRow) and row.material not in known:
                yield Complaint(
                    (*loc, "material"),
                    f"element {row.id}: there is no material '{row.material}'.",
                    nearest(row.material, known, "material"),
                )


@dataclass(frozen=True)
class Sections:
    """Sections exist."""

    needs: ClassVar[tuple[str, ...]] = ("sections",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every unknown section, and walls thicker than their tube."""
        known = case.spec.model.sections
        for loc, _, row in case.rows():
            if isinstance(row, LineRow | PlateRow) and row.section not in known:
                yield Complaint(
                    (*loc, "section"),
                    f"element {row.id}: there is no section '{row.section}'.",
                    nearest(row.section, known, "section"),
                )
        for name, section in known.items():
            if (
                section.shape == "circle"
                and section.wall is not None
                and 2 * section.wall > section.diameter
            ):
                yield Complaint(
                    ("model", "sections", name, "wall"),
                    f"a wall of {section.wall:g} m does not fit a diameter of "
                    f"{section.diameter:g} m.",
                    "It is at most half the diameter.",
                )


@dataclass(frozen=True)
class SectionShapes:
    """A plate has a plate section; a rod or beam has another one, with the properties it needs."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every section of the wrong shape, said once for each block and section."""
        for i, block in enumerate(case.spec.model.elements):
            if not isinstance(block, LineBlock | PlateBlock):
                continue
            said: set[str] = set()
            rows: Sequence[LineRow | PlateRow] = block.rows
            for j, row in enumerate(rows):
                section = case.spec.model.sections.get(row.section)
                if section is None or row.section in said:
                    continue
                said.add(row.section)
                at = ("model", "elements", i, "rows", j, "section")
                if (block.type == "plate") != (section.shape == "plate"):
                    wanted = (
                        "a section of shape plate"
                        if block.type == "plate"
                        else "rectangle, circle or general"
                    )
                    yield Complaint(
                        at,
                        f"element {row.id} is a {block.type}, but section '{row.section}' is "
                        f"a {section.shape}.",
                        f"It needs {wanted}.",
                    )
                elif section.shape == "general":
                    required = {"rod": ("A",), "beam2d": ("A",), "beam3d": ("A", "Iy", "Iz", "J")}[
                        block.type
                    ]
                    absent = [key for key in required if getattr(section, key) is None]
                    if block.type == "beam3d":
                        absent = [key for key in absent if _bends(key, case)]
                    elif block.type == "beam2d" and section.Iy is None and section.Iz is None:
                        absent = ["Iy or Iz"]
                    if absent:
                        yield Complaint(
                            ("model", "sections", row.section),
                            f"has no {' and no '.join(absent)}, which the {block.type} "
                            "elements need.",
                            f"Add {', '.join(absent)}.",
                        )


def _bends(key: str, case: Case) -> bool:
    """Whether a beam in space uses the property: always, unless nothing but one plane is active."""
    dofs = set(case.spec.model.dofs)
    if key == "J":
        return len(dofs & {"rx", "ry", "rz"}) > 1
    return len(dofs & {"rx", "ry", "rz"}) > 1 or len(dofs & {"x", "y", "z"}) > 2


@dataclass(frozen=True)
class SupportNodes:
    """Supports stand at nodes that exist."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every missing node of a support."""
        for i, support in enumerate(case.spec.model.supports):
            for node in support.nodes if support.nodes != "all" else ():
                if not case.has_node(node):
                    yield Complaint(
                        ("model", "supports", i, "nodes"),
                        f"node {node} is held, but does not exist.",
                        "Add the node to model.nodes, or correct the number.",
                    )
