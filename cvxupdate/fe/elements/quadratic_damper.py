"""Quadratic damper: a force in |v|v."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, quadratic
from cvxupdate.keys import DofKind, Dofs, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class QuadraticDamperRow(Row):
    """A quadratic damper: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    c2: float = Field(description="coefficient of abs(v) v [N·s²/m²]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class QuadraticDamperBlock(Block):
    """Damping by the square of velocity. No part in C: linear commands leave it out."""

    type: Literal["quadratic_damper"]
    rows: Annotated[tuple[QuadraticDamperRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    c2: float | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return quadratic(p["c2"])


@dataclass(frozen=True)
class QuadraticDamper:
    """Force c2 |v| v along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    dof: str
    nodes: int
    name: str = "quadratic_damper"
    properties: tuple[str, ...] = ("c2",)
    text: ClassVar[ElementText] = ElementText(QuadraticDamperBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: QuadraticDamperRow, block: QuadraticDamperBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes)), {"c2": row.c2})

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
