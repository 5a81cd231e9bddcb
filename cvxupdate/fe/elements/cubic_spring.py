"""Cubic spring: a restoring force in x³, hardening or softening."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, cubic
from cvxupdate.keys import DofKind, Dofs, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class CubicSpringRow(Row):
    """A cubic spring: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k3: float = Field(description="coefficient of x³, below 0 softening [N/m³]")
    k2: float = Field(default=0.0, description="coefficient of x·abs(x) [N/m²]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class CubicSpringBlock(Block):
    """Springs whose force grows as x cubed. No part in K: linear commands leave them out."""

    type: Literal["cubic_spring"]
    rows: Annotated[tuple[CubicSpringRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k3: float | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return cubic(p["k3"], p["k2"])


@dataclass(frozen=True)
class CubicSpring:
    """Force k3 x³ + k2 x|x| along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    dof: str
    nodes: int
    name: str = "cubic_spring"
    properties: tuple[str, ...] = (
        "k3",
        "k2",
    )
    text: ClassVar[ElementText] = ElementText(CubicSpringBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: CubicSpringRow, block: CubicSpringBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes)), {"k3": row.k3, "k2": row.k2})

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
