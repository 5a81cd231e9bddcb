"""Clearance: contact beyond a gap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, clearance
from cvxupdate.keys import DofKind, Dofs, NonNegative, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class ClearanceRow(Row):
    """A gap: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k: NonNegative = Field(description="stiffness in contact [N/m]")
    gap: float = Field(
        description="how far it moves freely [m]; one-sided, its sign is the side of contact"
    )
    sides: Literal["one", "two"] = Field(
        default="one", description="contact on one side, or on both"
    )
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class ClearanceBlock(Block):
    """Contact beyond a gap, open at rest. No part in K: linear commands leave it out."""

    type: Literal["clearance"]
    rows: Annotated[tuple[ClearanceRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: NonNegative | None = Field(default=None, description="for every row without its own")
    gap: float | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return clearance(p["k"], p["gap"], kind.sides)


@dataclass(frozen=True)
class Clearance:
    """Force k (x − gap) in contact along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    dof: str
    nodes: int
    sides: Literal["one", "two"] = "one"
    name: str = "clearance"
    properties: tuple[str, ...] = (
        "k",
        "gap",
    )
    text: ClassVar[ElementText] = ElementText(ClearanceBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: ClearanceRow, block: ClearanceBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes), row.sides), {"k": row.k, "gap": row.gap})

    @property
    def dofs(self) -> tuple[str, ...]:
        """The one kind of DOF it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: it has no part in K, M or C."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """None."""
        return {}
