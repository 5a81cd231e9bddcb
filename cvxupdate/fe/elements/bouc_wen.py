"""Bouc–Wen element: smooth hysteresis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, bouc_wen
from cvxupdate.keys import DofKind, Dofs, Positive, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class BoucWenRow(Row):
    """Smooth hysteresis: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k: Positive = Field(description="initial stiffness [N/m]")
    force: Positive = Field(description="limit of the force [N]")
    n: Annotated[float, Field(ge=1.0)] = Field(default=1.0, description="sharpness of the knee")
    gamma: Annotated[float, Field(ge=0.5, le=1.0)] = Field(
        default=0.5, description="shape of unloading; 0.5: it begins with k"
    )
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class BoucWenBlock(Block):
    """Smooth hysteresis. No part in K: linear commands leave it out."""

    type: Literal["bouc_wen"]
    rows: Annotated[tuple[BoucWenRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: Positive | None = Field(default=None, description="for every row without its own")
    force: Positive | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return bouc_wen(p["k"], p["force"], p["n"], p["gamma"])


@dataclass(frozen=True)
class BoucWen:
    """Force from Wen's differential equation along ``dof`` (Wen 1976)."""

    dof: str
    nodes: int
    name: str = "bouc_wen"
    properties: tuple[str, ...] = (
        "k",
        "force",
        "n",
        "gamma",
    )
    text: ClassVar[ElementText] = ElementText(BoucWenBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: BoucWenRow, block: BoucWenBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(
                cls(dof, len(row.nodes)),
                {"k": row.k, "force": row.force, "n": row.n, "gamma": row.gamma},
            )

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
