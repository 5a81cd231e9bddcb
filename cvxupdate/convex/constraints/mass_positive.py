"""The mass stays positive: of every element, of the assembled matrix, or both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field

from cvxupdate.keys import NonNegative, Part

from ..context import Context, Key
from .clauses import Clause
from .element_mass import ElementMass
from .matrix_inequality import MatrixInequality

MASS_WORDS = ("mass", "rho", "m")


class MassPositiveTable(Part):
    """The mass stays positive: of every element, of the assembled matrix (a linear matrix
    inequality), or both."""

    elements: bool = Field(default=True, description="every mass p-value stays above -1")
    matrix: bool = Field(
        default=False, description="the assembled mass matrix stays positive definite"
    )
    floor: NonNegative = Field(
        default=1e-3,
        description="smallest eigenvalue, of the matrix scaled to a unit diagonal; "
        "smallest 1 + p of an element",
    )


@dataclass(frozen=True, eq=False)
class MassPositive:
    """Element masses and the assembled mass matrix stay positive; None leaves one out."""

    elements: ElementMass | None
    matrix: MatrixInequality | None
    keys: ClassVar[Mapping[str, Key]] = {
        "mass_positive": Key(MassPositiveTable, "mass positive definite")
    }

    @classmethod
    def from_spec(cls, table: MassPositiveTable, context: Context) -> MassPositive:
        """Of every parameter that scales masses, and of M(p)."""
        names = context.changing(*MASS_WORDS) if table.elements else ()
        matrix = None
        if table.matrix:
            base, parts = context.matrix("M", "constraints.mass_positive")
            label = definite("the assembled mass matrix", table.floor)
            matrix = MatrixInequality(base, parts, label, table.floor)
        return cls(ElementMass(names, table.floor) if names else None, matrix)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """The clauses of both parts."""
        parts = [part for part in (self.elements, self.matrix) if part is not None]
        return tuple(clause for part in parts for clause in part.clauses(columns))


def definite(what: str, floor: float) -> str:
    """The clause in words."""
    if floor > 0:
        return f"{what} stays positive definite (eigenvalues at least {floor:g})"
    return f"{what} stays positive semidefinite"
