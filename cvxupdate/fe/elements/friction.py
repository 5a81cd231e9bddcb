"""Coulomb friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, friction
from cvxupdate.keys import NonNegative, Table
from cvxupdate.spec.elements import ElementText


class FrictionRow(AlongRow):
    """A slider: to ground (one node) or between two."""

    force: NonNegative = Field(description="friction force [N]")


class FrictionBlock(AlongBlock):
    """Dry friction. No part in C: linear commands leave it out."""

    type: Literal["friction"]
    rows: Annotated[tuple[FrictionRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    force: NonNegative | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return friction(p["force"])


@dataclass(frozen=True)
class Friction(Along):
    """Force ± ``force`` against the motion along ``dof``, whatever holds it at rest (Coulomb)."""

    name: str = "friction"
    properties: tuple[str, ...] = ("force",)
    text: ClassVar[ElementText] = ElementText(FrictionBlock, changes=(), law=_laws)
