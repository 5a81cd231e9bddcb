"""What exact elements cannot take: anything that needs matrices which do not depend on the
frequency."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import text_of
from cvxupdate.spec.model import ModalDamping
from cvxupdate.spec.prepare import Complaint

MESH = "or mesh the members with beam3d"
METHODS = ("rfm", "frequencies", "sensitivity", "minimum-variance")


@dataclass(frozen=True)
class ExactElements:
    """Exact elements stand in a linear model that is updated on its responses or its modes."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "damping")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """A method, basis, damping or element that needs K and M."""
        blocks = list(enumerate(case.spec.model.elements))
        exact = [block.type for _, block in blocks if text_of(block).exact is not None]
        if not exact:
            return
        says = f"needs matrices that do not depend on the frequency, and {exact[0]} has none."
        for i, block in blocks:
            if text_of(block).law is not None:
                yield Complaint(
                    ("model", "elements", i, "type"),
                    f"{block.type} {says}",
                    f"Take it out, {MESH}.",
                )
        if isinstance(case.spec.model.damping, ModalDamping):
            yield Complaint(
                ("model", "damping", "kind"),
                f"'modal' {says}",
                'Take kind = "structural" or "rayleigh".',
            )
        update = case.spec.update
        if update is None:
            return
        if update.method not in METHODS:
            yield Complaint(
                ("update", "method"),
                f"'{update.method}' {says}",
                f'Take method = "rfm" for responses, "sensitivity" for modes, {MESH}.',
            )
        elif update.basis != "full":
            yield Complaint(("update", "basis"), f"'{update.basis}' {says}", 'Take basis = "full".')
