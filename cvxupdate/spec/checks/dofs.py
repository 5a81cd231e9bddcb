"""DOF kinds: active once each, and active where something acts on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import MATRICES, OWN_LABELS, Row, text_of
from cvxupdate.spec.prepare import Complaint


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
        auto = any(row.get("labels") == "auto" and not _may_know(row) for _, _, row in case.rows())
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
            if not {"dof", "dofs"} <= set(type(row).model_fields):
                continue
            if (row.get("dof") is None) == (row.get("dofs") is None):
                both = row.get("dof") is not None
                yield Complaint(
                    (*loc, "dof"),
                    f"{block.type} {row.id} has {'both `dof` and `dofs`' if both else 'no `dof`'}.",
                    "Give one of `dof` and `dofs`, on the row or on the block.",
                )
                continue
            for dof in row.directions:
                if dof not in active:
                    yield Complaint(
                        (*loc, "dof" if row.get("dof") else "dofs"),
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
        for i, block in enumerate(case.spec.model.elements):
            lacking = text_of(block).lacking(block, tuple(case.spec.model.dofs))
            if lacking is not None:
                yield Complaint(("model", "elements", i, "type"), *lacking)


def _may_know(row: Row) -> bool:
    """Whether a file of a matrix row may name the DOFs of its rows itself."""
    names = [str(row.get(key)) for key in (*MATRICES, "file")]
    return any(name.lower().endswith(OWN_LABELS) for name in names)
