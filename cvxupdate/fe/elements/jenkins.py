"""Jenkins element: a spring and a slider in series."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.forces import Laws, jenkins
from cvxupdate.keys import DofKind, Dofs, NonNegative, Positive, Table
from cvxupdate.spec.elements import Block, ElementText, Group, OneOrTwoNodes, Row


class JenkinsRow(Row):
    """A spring and a slider: to ground (one node) or between two."""

    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k: Positive = Field(description="stiffness while it sticks [N/m]")
    force: NonNegative = Field(description="force at which it slips [N]")
    play: NonNegative = Field(default=0.0, description="free play in series, its whole width [m]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same values"
    )
    group: Group = None


class JenkinsBlock(Block):
    """Stick and slip with memory. No part in K: linear commands leave it out."""

    type: Literal["jenkins"]
    rows: Annotated[tuple[JenkinsRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: Positive | None = Field(default=None, description="for every row without its own")
    force: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return jenkins(p["k"], p["force"], p["play"])


@dataclass(frozen=True)
class Jenkins:
    """Elastic up to ``force``, then slipping, along ``dof`` (Jenkin 1922; Iwan 1966)."""

    dof: str
    nodes: int
    name: str = "jenkins"
    properties: tuple[str, ...] = (
        "k",
        "force",
        "play",
    )
    text: ClassVar[ElementText] = ElementText(JenkinsBlock, changes=(), law=_laws)
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what other elements bring

    @classmethod
    def from_row(
        cls, row: JenkinsRow, block: JenkinsBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One for each direction."""
        for dof in row.directions:
            yield Placed(
                cls(dof, len(row.nodes)), {"k": row.k, "force": row.force, "play": row.play}
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
