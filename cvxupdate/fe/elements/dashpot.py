"""Dashpot: a viscous damper along one DOF, to ground or between two nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.elements.spring import pair
from cvxupdate.keys import DofKind, Dofs, NonNegative, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class DashpotRow(Row):
    """A viscous damper: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    c: NonNegative = Field(description="viscous coefficient [N·s/m or N·m·s/rad]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same value"
    )
    group: Group = None


class DashpotBlock(Block):
    """Viscous dampers."""

    type: Literal["dashpot"]
    rows: Annotated[tuple[DashpotRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    c: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


@dataclass(frozen=True)
class Dashpot:
    """Force c·(v₂ − v₁) along ``dof``, or c·v against ground where ``nodes`` is 1."""

    dof: str
    nodes: int
    name: str = "dashpot"
    properties: tuple[str, ...] = ("c",)
    text: ClassVar[ElementText] = ElementText(DashpotBlock, changes=("damping", "c"))
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(
        cls, row: DashpotRow, block: DashpotBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One damper for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes)), {"c": row.c})

    @property
    def dofs(self) -> tuple[str, ...]:
        """The one kind of DOF it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit damping."""
        return (Term("C", "c", pair(len(xyz), self.nodes)),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """c in N·s/m or N·m·s/rad."""
        return {"c": properties["c"]}
