"""How the linearised equations are solved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.prepare import Complaint


@dataclass(frozen=True)
class SolutionApplies:
    """A classical solution belongs to a method that linearises equations."""

    needs: ClassVar[tuple[str, ...]] = ("update",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """A ``solution`` beside a method that has one of its own."""
        update = case.spec.update
        if update is None or update.solution == "convex":
            return
        if update.method not in ("frequencies", "sensitivity", "rfm"):
            yield Complaint(
                ("update", "solution"),
                f"does not apply to method '{update.method}'.",
                'Take method = "frequencies", "sensitivity" or "rfm", or leave the solution out.',
            )
