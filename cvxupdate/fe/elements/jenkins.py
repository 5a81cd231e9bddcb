"""Jenkins element: a spring and a slider in series."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.elements.along import Along, AlongBlock, AlongRow
from cvxupdate.fe.elements.base import Real
from cvxupdate.forces import Laws, jenkins
from cvxupdate.keys import NonNegative, Positive, Table
from cvxupdate.spec.elements import ElementText


class JenkinsRow(AlongRow):
    """A spring and a slider: to ground (one node) or between two."""

    k: Positive = Field(description="stiffness while it sticks [N/m]")
    force: NonNegative = Field(description="force at which it slips [N]")
    play: NonNegative = Field(default=0.0, description="free play in series, its whole width [m]")


class JenkinsBlock(AlongBlock):
    """Stick and slip with memory. No part in K: linear commands leave it out."""

    type: Literal["jenkins"]
    rows: Annotated[tuple[JenkinsRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: Positive | None = Field(default=None, description="for every row without its own")
    force: NonNegative | None = Field(default=None, description="for every row without its own")


def _laws(kind: Any, p: Mapping[str, Real]) -> Laws:
    return jenkins(p["k"], p["force"], p["play"])


@dataclass(frozen=True)
class Jenkins(Along):
    """Elastic up to ``force``, then slipping, along ``dof`` (Jenkin 1922; Iwan 1966)."""

    name: str = "jenkins"
    properties: tuple[str, ...] = (
        "k",
        "force",
        "play",
    )
    text: ClassVar[ElementText] = ElementText(JenkinsBlock, changes=(), law=_laws)
