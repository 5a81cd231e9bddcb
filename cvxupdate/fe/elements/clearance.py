"""Clearance: contact beyond a gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, clearance
from cvxupdate.keys import NonNegative, Table
from cvxupdate.spec.elements import ElementText


class ClearanceRow(AlongRow):
    """A gap: to ground (one node) or between two."""

    k: NonNegative = Field(description="stiffness in contact [N/m]")
    gap: float = Field(
        description="how far it moves freely [m]; one-sided, its sign is the side of contact"
    )
    sides: Literal["one", "two"] = Field(
        default="one", description="contact on one side, or on both"
    )


class ClearanceBlock(AlongBlock):
    """Contact beyond a gap, open at rest. No part in K: linear commands leave it out."""

    type: Literal["clearance"]
    rows: Annotated[tuple[ClearanceRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: NonNegative | None = Field(default=None, description="for every row without its own")
    gap: float | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return clearance(p["k"], p["gap"], kind.sides)


@dataclass(frozen=True)
class Clearance(Along):
    """Force k (x − gap) in contact along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    name: str = "clearance"
    properties: tuple[str, ...] = (
        "k",
        "gap",
    )
    sides: Literal["one", "two"] = "one"
    text: ClassVar[ElementText] = ElementText(ClearanceBlock, changes=(), law=_laws)

    @classmethod
    def of(cls, row: ClearanceRow, dof: str) -> Self:
        """With contact on as many sides as the row says."""
        return cls(dof, len(row.nodes), sides=row.sides)
