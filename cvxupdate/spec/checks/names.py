"""Numbers and names: unique where they are given, known where they are used."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import text_of
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
            for node in row.get("nodes", ()):
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
            labels = row.get("labels")
            if not isinstance(labels, tuple):
                continue
            if len(set(labels)) < len(labels):
                yield Complaint(
                    (*loc, "labels"),
                    f"element {row.id} names a DOF twice.",
                    "Give each row of the matrix its own label.",
                )
            for label in labels:
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
            material = row.get("material")
            if material is not None and material not in known:
                yield Complaint(
                    (*loc, "material"),
                    f"element {row.id}: there is no material '{material}'.",
                    nearest(material, known, "material"),
                )


@dataclass(frozen=True)
class Sections:
    """Sections exist."""

    needs: ClassVar[tuple[str, ...]] = ("sections",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every unknown section, and walls thicker than their tube."""
        known = case.spec.model.sections
        for loc, _, row in case.rows():
            section = row.get("section")
            if section is not None and section not in known:
                yield Complaint(
                    (*loc, "section"),
                    f"element {row.id}: there is no section '{section}'.",
                    nearest(section, known, "section"),
                )
        for name, shape in known.items():
            if (
                shape.shape == "circle"
                and shape.wall is not None
                and 2 * shape.wall > shape.diameter
            ):
                yield Complaint(
                    ("model", "sections", name, "wall"),
                    f"a wall of {shape.wall:g} m does not fit a diameter of {shape.diameter:g} m.",
                    "It is at most half the diameter.",
                )


@dataclass(frozen=True)
class SectionShapes:
    """A plate has a plate section; a rod or beam has another one, with the properties it needs."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every section of the wrong shape, said once for each block and section."""
        for i, block in enumerate(case.spec.model.elements):
            shapes = text_of(block).sections
            said: set[str] = set()
            for j, row in enumerate(block.rows):
                name = row.get("section")
                section = case.spec.model.sections.get(name)
                if section is None or name in said:
                    continue
                said.add(name)
                if section.shape not in shapes:
                    *most, last = shapes or ("none",)
                    several = f"{', '.join(most)} or {last}"
                    wanted = several if most else f"a section of shape {last}"
                    yield Complaint(
                        ("model", "elements", i, "rows", j, "section"),
                        f"element {row.id} is a {block.type}, but section '{name}' is a "
                        f"{section.shape}.",
                        f"It needs {wanted}.",
                    )
                    continue
                absent = [
                    " or ".join(keys)
                    for keys in shapes[section.shape]
                    if all(getattr(section, key) is None for key in keys)
                    and (len(keys) > 1 or _bends(keys[0], case))
                ]
                if absent:
                    yield Complaint(
                        ("model", "sections", name),
                        f"has no {' and no '.join(absent)}, which the {block.type} elements need.",
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
