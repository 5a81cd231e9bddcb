"""Families of element matrices: what their table may say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.keys import Loc
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.generic import GENERIC
from cvxupdate.spec.parameters import carriers_of, members_of
from cvxupdate.spec.prepare import Complaint


@dataclass(frozen=True)
class GenericFamily:
    """A `family` belongs to `of = "generic"`, and numbers of modes to one matrix."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every family that nothing reads, and lists of modes that two matrices would share."""
        update = case.spec.update
        for i, row in enumerate(update.parameters if update is not None else ()):
            at = ("update", "parameters", i, "family")
            if row.family is None:
                continue
            if row.of != GENERIC:
                yield Complaint(
                    at,
                    f"does not apply to '{row.of}', which changes one number.",
                    f'Take of = "{GENERIC}", or leave `family` out.',
                )
            elif isinstance(row.family.classes, tuple) and len(set(row.family.matrices)) > 1:
                yield Complaint(
                    (*at, "classes"),
                    "names modes by number, but K and M number their modes each by itself.",
                    'Give matrices = ["K"] here and a row of its own to "M".',
                )


@dataclass(frozen=True)
class Members:
    """Rows of [[model.families]] name elements that have whole matrices, in one way."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every row that says it twice or not at all, and elements that have no family."""
        carriers = carriers_of(case.spec.model, GENERIC) if case.spec.model.families else {}
        for i, row in enumerate(case.spec.model.families):
            at: Loc = ("model", "families", i)
            if not row.changes():
                yield Complaint(at, "changes no matrix.", "Give K, M or both.")
            elif (row.elements is None) == (row.group is None):
                said = "names no elements" if row.group is None else "names elements and a group"
                yield Complaint(at, f"{said}.", "Name exactly one of elements, group.")
            elif row.group is not None and row.group not in case.groups:
                at = (*at, "group")
                yield Complaint(at, f"names no group: {row.group!r}.", "Correct the name.")
            elif isinstance(row.elements, tuple):
                wrong = [e for e in row.elements if e not in carriers]
                if wrong:
                    yield Complaint(
                        (*at, "elements"),
                        f"element {wrong[0]} does not exist, or has no matrix between nodes.",
                        "Name rods, beams, plates, shells, solids or given matrices.",
                    )


@dataclass(frozen=True)
class MembersMoved:
    """What is a member of a family moves by entries of that family alone: factors and moduli would
    act on the nominal part of its matrices."""

    needs: ClassVar[tuple[str, ...]] = ("update",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """The first parameter of another kind on such elements, and a finer mesh under them."""
        rows, update = case.spec.model.families, case.spec.update
        if not rows or update is None:
            return
        held = {e for row in rows for e in members_of(case.spec.model, row)}
        moved = [
            (i, e)
            for i, targets in case.targets_by_row.items()
            for t in targets
            if t.of != GENERIC
            for e in t.elements or sorted(held)
            if e in held
        ]
        for i, e in moved[:1]:
            yield Complaint(
                ("update", "parameters", i),
                f"acts on element {e}, whose matrix is given by [[model.families]].",
                f'Take of = "{GENERIC}", name other elements, or take the family out.',
            )
        parts = case.spec.model.refine
        if update.refine is not None or parts is not None:
            yield Complaint(
                ("model" if update.refine is None else "update", "refine"),
                "divides elements whose matrices are given by [[model.families]].",
                "Leave one of them out: a family already has the mesh in it.",
            )
