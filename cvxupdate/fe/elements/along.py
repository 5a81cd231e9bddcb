"""What nonlinear elements share that act along one DOF: rows, blocks, and no part in K, M or C."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.keys import DofKind, Dofs
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class AlongRow(Row):
    """An element to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class AlongBlock(Block):
    """Their common directions and group."""

    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


@dataclass(frozen=True)
class Along:
    """A force along ``dof``, to ground or between two ``nodes``, that no matrix says."""

    dof: str
    nodes: int
    name: str = ""
    properties: tuple[str, ...] = ()
    text: ClassVar[ElementText]
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(cls, row: Any, block: Any, around: Surroundings) -> Iterator[Placed]:
        """One for each direction, with the row's value of each property."""
        for dof in row.directions:
            kind = cls.of(row, dof)
            yield Placed(kind, {name: getattr(row, name) for name in kind.properties})

    @classmethod
    def of(cls, row: Any, dof: str) -> Self:
        """The element of a row along one of its directions."""
        return cls(dof, len(row.nodes))

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
