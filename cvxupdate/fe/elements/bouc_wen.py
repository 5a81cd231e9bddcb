"""Bouc–Wen element: smooth hysteresis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, bouc_wen
from cvxupdate.keys import Positive, Table
from cvxupdate.spec.elements import ElementText


class BoucWenRow(AlongRow):
    """Smooth hysteresis: to ground (one node) or between two."""

    k: Positive = Field(description="initial stiffness [N/m]")
    force: Positive = Field(description="limit of the force [N]")
    n: Annotated[float, Field(ge=1.0)] = Field(default=1.0, description="sharpness of the knee")
    gamma: Annotated[float, Field(ge=0.5, le=1.0)] = Field(
        default=0.5, description="shape of unloading; 0.5: it begins with k"
    )


class BoucWenBlock(AlongBlock):
    """Smooth hysteresis. No part in K: linear commands leave it out."""

    type: Literal["bouc_wen"]
    rows: Annotated[tuple[BoucWenRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: Positive | None = Field(default=None, description="for every row without its own")
    force: Positive | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return bouc_wen(p["k"], p["force"], p["n"], p["gamma"])


@dataclass(frozen=True)
class BoucWen(Along):
    """Force from Wen's differential equation along ``dof`` (Wen 1976)."""

    name: str = "bouc_wen"
    properties: tuple[str, ...] = (
        "k",
        "force",
        "n",
        "gamma",
    )
    text: ClassVar[ElementText] = ElementText(BoucWenBlock, changes=(), law=_laws)
