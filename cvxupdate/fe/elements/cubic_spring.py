"""Cubic spring: a restoring force in x³, hardening or softening."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, cubic
from cvxupdate.keys import Table
from cvxupdate.spec.elements import ElementText


class CubicSpringRow(AlongRow):
    """A cubic spring: to ground (one node) or between two."""

    k3: float = Field(description="coefficient of x³, below 0 softening [N/m³]")
    k2: float = Field(default=0.0, description="coefficient of x·abs(x) [N/m²]")
    even: float = Field(
        default=0.0, description="coefficient of x²: stiffer one way, softer the other [N/m²]"
    )


class CubicSpringBlock(AlongBlock):
    """Springs whose force grows as x cubed. No part in K: linear commands leave them out."""

    type: Literal["cubic_spring"]
    rows: Annotated[tuple[CubicSpringRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k3: float | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return cubic(p["k3"], p["k2"], p["even"])


@dataclass(frozen=True)
class CubicSpring(Along):
    """Force k3 x³ + k2 x|x| + even x² along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    name: str = "cubic_spring"
    properties: tuple[str, ...] = (
        "k3",
        "k2",
        "even",
    )
    text: ClassVar[ElementText] = ElementText(CubicSpringBlock, changes=(), law=_laws)
