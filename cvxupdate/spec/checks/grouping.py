"""Macro elements that the recordings choose have single parameters to be chosen from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.generic import GENERIC
from cvxupdate.spec.prepare import Complaint


@dataclass(frozen=True)
class ParameterGrouping:
    """`grouping` stands beside `each`, in a row of elements that are not generic, and `resolution`
    beside `grouping`."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every row whose choice has nothing to choose from."""
        update = case.spec.update
        for i, row in enumerate(update.parameters if update is not None else ()):
            at = ("update", "parameters", i)
            if update is not None and row.grouping is not None and update.method == "direct":
                remedy = "Leave it out: direct methods know no parameters."
                yield Complaint((*at, "grouping"), "does not apply to method 'direct'.", remedy)
            elif row.grouping is not None and row.of == GENERIC:
                remedy = "Leave it out: families tie elements by rules of their own."
                yield Complaint((*at, "grouping"), "does not apply to of = 'generic'.", remedy)
            elif row.grouping is not None and row.each is None:
                remedy = 'Add each = "element" or each = "group".'
                yield Complaint((*at, "grouping"), "has one parameter only to choose from.", remedy)
            if row.resolution is not None and row.grouping in (None, "subset"):
                remedy = 'Leave it out, or add grouping = "clusters" or "total-variation".'
                yield Complaint((*at, "resolution"), "has nothing to act on.", remedy)
