"""Families of element matrices: what their table may say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.generic import GENERIC
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
