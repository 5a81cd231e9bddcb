"""DOF kinds: active once each, and active where something acts on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import DashpotRow, MatrixRow, SpringRow
from cvxupdate.spec.prepare import Complaint

TRANSLATIONS = frozenset({"x", "y", "z"})


@dataclass(frozen=True)
class ActiveDofs:
    """The list of active kinds has no repetition, and "auto" labels have their kind."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Repetitions, here and in supports; a model without nodes."""
        model = case.spec.model
        if len(set(model.dofs)) < len(model.dofs):
            yield Complaint(
                ("model", "dofs"), f"{list(model.dofs)} names a kind twice.", "Name each kind once."
            )
        bare = (
            not model.nodes
            and "nodes" not in case.damaged
            and not case.open_nodes
            and not case.labels
        )
        if bare:
            yield Complaint(
                ("model", "nodes"),
                "there are no nodes.",
                'Add the nodes, or { file = "nodes.csv" }.',
            )
        auto = any(isinstance(row, MatrixRow) and row.labels == "auto" for _, _, row in case.rows())
        if auto and "x" not in model.dofs:
            yield Complaint(
                ("model", "dofs"),
                'has no "x", but a matrix block numbers its DOFs n<i>.x (labels = "auto").',
                'Add "x" to model.dofs, or give `labels`.',
            )


@dataclass(frozen=True)
class Directions:
    """A spring or dashpot acts along one active DOF kind, or several."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every direction that is missing, doubled or not active."""
        active = case.spec.model.dofs
        for loc, block, row in case.rows():
            if not isinstance(row, SpringRow | DashpotRow):
                continue
            if (row.dof is None) == (row.dofs is None):
                both = row.dof is not None
                yield Complaint(
                    (*loc, "dof"),
                    f"{block.type} {row.id} has {'both `dof` and `dofs`' if both else 'no `dof`'}.",
                    "Give one of `dof` and `dofs`, on the row or on the block.",
                )
                continue
            for dof in row.directions:
                if dof not in active:
                    yield Complaint(
                        (*loc, "dof" if row.dof else "dofs"),
                        f"{block.type} {row.id} acts along '{dof}', but the active DOFs are "
                        f"{', '.join(active)}.",
                        f"Add '{dof}' to model.dofs, or correct the direction.",
                    )


@dataclass(frozen=True)
class TypeDofs:
    """The active kinds let an element type move as it must."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every block that has not the DOFs it works with."""
        active: set[str] = set(case.spec.model.dofs)
        bends = bool(active & {"rx", "ry", "rz"})
        for i, block in enumerate(case.spec.model.elements):
            if block.type == "plate" and not {"z", "rx", "ry"} <= active:
                lacking = sorted({"z", "rx", "ry"} - active)
                problem, remedy = (
                    f"plate elements need z, rx and ry; {', '.join(lacking)} not active.",
                    "Add them to model.dofs.",
                )
            elif (
                block.type in ("rod", "mass")
                and not active & TRANSLATIONS
                and not _inertia_only(block)
            ):
                problem, remedy = (
                    f"{block.type} elements need a translation, and none is active.",
                    "Add x, y or z to model.dofs.",
                )
            elif (
                block.type in ("beam2d", "beam3d")
                and not (bends and active & TRANSLATIONS)
                and not _axial(active)
            ):
                active_now = ", ".join(case.spec.model.dofs)
                problem = (
                    f"{block.type} elements need translations and rotations; active are "
                    f"{active_now}."
                )
                remedy = (
                    'Add to model.dofs, e.g. ["z", "ry"] for bending in the x–z plane; a rod has '
                    "translations only."
                )
            elif block.type == "gyroscopic" and len(active & {"rx", "ry", "rz"}) < 2:
                problem, remedy = (
                    "a gyroscopic moment couples two rotations.",
                    "Add both rotations square to the axis to model.dofs.",
                )
            else:
                continue
            yield Complaint(("model", "elements", i, "type"), problem, remedy)


def _axial(active: set[str]) -> bool:
    """A beam along x of which only the torsion is wanted."""
    return active == {"rx"}


def _inertia_only(block: object) -> bool:
    rows = getattr(block, "rows", ())
    return all(getattr(row, "m", 1.0) == 0.0 for row in rows)
