"""Quadratic damper: a force in |v|v."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, quadratic
from cvxupdate.keys import Table
from cvxupdate.spec.elements import ElementText


class QuadraticDamperRow(AlongRow):
    """A quadratic damper: to ground (one node) or between two."""

    c2: float = Field(description="coefficient of abs(v) v [N·s²/m²]")


class QuadraticDamperBlock(AlongBlock):
    """Damping by the square of velocity. No part in C: linear commands leave it out."""

    type: Literal["quadratic_damper"]
    rows: Annotated[tuple[QuadraticDamperRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    c2: float | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return quadratic(p["c2"])


@dataclass(frozen=True)
class QuadraticDamper(Along):
    """Force c2 |v| v along ``dof`` (Worden and Tomlinson 2001, section 2.2)."""

    name: str = "quadratic_damper"
    properties: tuple[str, ...] = ("c2",)
    text: ClassVar[ElementText] = ElementText(QuadraticDamperBlock, changes=(), law=_laws)
