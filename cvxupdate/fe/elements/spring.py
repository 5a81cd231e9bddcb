"""Spring: a stiffness along one DOF, to ground or between two nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.keys import DofKind, Dofs, NonNegative, Table
from cvxupdate.spec.elements import (
    Block,
    ElementText,
    Group,
    OneOrTwoNodes,
    Row,
)
from cvxupdate.spec.factors import DampingFactor, Loss, StiffnessFactor


class SpringRow(Row):
    """A spring: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k: NonNegative = Field(description="stiffness [N/m or N·m/rad]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same value"
    )
    edge: bool = Field(
        default=False,
        description="a spring to ground on the edge of a sheet that is held all along: on finer "
        "parts (`refine` of [model]) it is spread to its neighbours of this sort and to supports",
    )
    stiffness_factor: StiffnessFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None
    group: Group = None

    @model_validator(mode="after")
    def _to_ground(self) -> Self:
        if self.edge and len(self.nodes) != 1:
            raise ValueError(
                f"edge: is for springs to ground; element {self.id} joins two nodes. Name one "
                "node, or leave `edge` out."
            )
        return self


class SpringBlock(Block):
    """Springs."""

    type: Literal["spring"]
    rows: Annotated[tuple[SpringRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


@dataclass(frozen=True)
class Spring:
    """Force k·(u₂ − u₁) along ``dof``, or k·u against ground where ``nodes`` is 1; ``edge``: part
    of what holds the edge of a sheet (`cvxupdate.fe.analysis.rims`)."""

    dof: str
    nodes: int
    edge: bool = False
    name: str = "spring"
    properties: tuple[str, ...] = ("k",)
    text: ClassVar[ElementText] = ElementText(
        SpringBlock, changes=("stiffness", "k", "damping", "eta", "beta")
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: SpringRow, block: SpringBlock, around: Surroundings) -> Iterator[Placed]:
        """One spring for each direction."""
        for dof in row.directions:
            yield Placed(cls(dof, len(row.nodes), row.edge), {"k": row.k})

    @property
    def dofs(self) -> tuple[str, ...]:
        """The one kind of DOF it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit stiffness."""
        return (Term("K", "k", pair(len(xyz), self.nodes)),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """k in N/m or N·m/rad."""
        return {"k": properties["k"]}


def pair(elements: int, nodes: int) -> Real:
    """[[1]] or [[1, −1], [−1, 1]] for each element."""
    unit = np.ones((1, 1)) if nodes == 1 else np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.broadcast_to(unit, (elements, *unit.shape))
