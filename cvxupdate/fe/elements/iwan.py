"""Iwan element: Jenkins elements in parallel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.along import AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.elements.jenkins import Jenkins
from cvxupdate.keys import NonNegative, Positive, Table
from cvxupdate.spec.elements import ElementText


class IwanRow(AlongRow):
    """Springs and sliders in parallel: to ground (one node) or between two."""

    stiffnesses: tuple[Positive, ...] = Field(
        min_length=1, description="of each while it sticks [N/m]"
    )
    forces: tuple[NonNegative, ...] = Field(
        min_length=1, description="at which each of them slips [N]"
    )


class IwanBlock(AlongBlock):
    """A distribution of stick and slip. No part in K: linear commands leave it out."""

    type: Literal["iwan"]
    rows: Annotated[tuple[IwanRow, ...], Table()] = Field(min_length=1, description="the elements")


@dataclass(frozen=True)
class Iwan:
    """Jenkins elements side by side (Iwan 1966); in the model each is one of its own."""

    name: str = "iwan"
    nodes: int = 1
    dofs: tuple[str, ...] = ()
    properties: tuple[str, ...] = ()
    text: ClassVar[ElementText] = ElementText(IwanBlock, changes=())
    brings: ClassVar[Mapping[str, str] | None] = {}

    @classmethod
    def from_row(cls, row: IwanRow, block: IwanBlock, around: Surroundings) -> Iterator[Placed]:
        """One Jenkins element for each pair of stiffness and force, and direction."""
        if len(row.stiffnesses) != len(row.forces):
            raise ModelError(
                f"iwan {row.id} has {len(row.stiffnesses)} stiffnesses and {len(row.forces)} "
                "forces. Give one force for each stiffness."
            )
        for dof in row.directions:
            for k, force in zip(row.stiffnesses, row.forces, strict=True):
                yield Placed(Jenkins(dof, len(row.nodes)), {"k": k, "force": force, "play": 0.0})

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: it has no part in K, M or C."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """None."""
        return {}
