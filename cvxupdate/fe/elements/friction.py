"""Coulomb friction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, friction
from cvxupdate.keys import DofKind, Dofs, NonNegative, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class FrictionRow(Row):
    """A slider: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    force: NonNegative = Field(description="friction force [N]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class FrictionBlock(Block):
    """Dry friction. No part in C: linear commands leave it out."""

    type: Literal["friction"]
    rows: Annotated[tuple[FrictionRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    force: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return friction(p["force"])


@dataclass(frozen=True)
class Friction:
    """Force ± ``force`` against the motion along ``dof``, whatever holds it at rest (Coulomb)."""

    dof: str
    nodes: int
    name: str = "friction"
    properties: tuple[str, ...] = ("force",)
    text: ClassVar[ElementText] = ElementText(FrictionBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: FrictionRow, block: FrictionBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes)), {"force": row.force})

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
