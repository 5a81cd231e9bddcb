"""Lumped mass at a node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.keys import NonNegative, Table
from cvxupdate.spec.elements import (
    Block,
    ElementText,
    Group,
    Lacking,
    OneNode,
    Row,
    translation_lacking,
)
from cvxupdate.spec.factors import DampingFactor, MassFactor

_PLACES = {"m": (0, 1, 2), "Ixx": (3,), "Iyy": (4,), "Izz": (5,)}


class MassRow(Row):
    """A lump: mass in every active translation, inertia in the active rotations."""

    nodes: OneNode = Field(description="[i], the node that carries it")
    m: NonNegative = Field(description="mass [kg]")
    Ixx: NonNegative = Field(default=0.0, description="inertia about x through the node [kg·m²]")
    Iyy: NonNegative = Field(default=0.0, description="inertia about y [kg·m²]")
    Izz: NonNegative = Field(default=0.0, description="inertia about z [kg·m²]")
    taken_off: bool = Field(
        default=False,
        description="the lump is taken off what the other elements have: it counts negative",
    )
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    group: Group = None


class MassBlock(Block):
    """Lumped masses."""

    type: Literal["mass"]
    rows: Annotated[tuple[MassRow, ...], Table()] = Field(min_length=1, description="the elements")
    m: NonNegative | None = Field(default=None, description="for every row without its own")
    Ixx: NonNegative | None = Field(default=None, description="for every row without its own")
    Iyy: NonNegative | None = Field(default=None, description="for every row without its own")
    Izz: NonNegative | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _lacking(block: MassBlock, active: tuple[str, ...]) -> Lacking:
    """Inertias alone need no translation."""
    inertia_only = all(row.m == 0.0 for row in block.rows)
    return None if inertia_only else translation_lacking(block, active)


@dataclass(frozen=True)
class Mass:
    """m on the translations, Ixx, Iyy, Izz about the node on the rotations."""

    name: str = "mass"
    nodes: int = 1
    dofs: tuple[str, ...] = ("x", "y", "z", "rx", "ry", "rz")
    properties: tuple[str, ...] = ("m", "Ixx", "Iyy", "Izz")
    text: ClassVar[ElementText] = ElementText(
        MassBlock,
        changes=("mass", "m", "Ixx", "Iyy", "Izz", "damping", "alpha"),
        joins=False,
        lacking=_lacking,
    )
    # no inertia about an axis: no DOF of its own there
    brings: ClassVar[Mapping[str, str] | None] = {
        **dict.fromkeys(("x", "y", "z"), "m"),
        "rx": "Ixx",
        "ry": "Iyy",
        "rz": "Izz",
    }

    @classmethod
    def from_row(cls, row: MassRow, block: MassBlock, around: Surroundings) -> Iterator[Placed]:
        """One lump; one that is taken off counts negative."""
        sign = -1.0 if row.taken_off else 1.0
        inertia = {"m": row.m, "Ixx": row.Ixx, "Iyy": row.Iyy, "Izz": row.Izz}
        yield Placed(cls(), {name: sign * value for name, value in inertia.items()})

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit masses."""
        out = []
        for name, places in _PLACES.items():
            unit = np.zeros((len(xyz), 6, 6))
            unit[:, places, places] = 1.0
            out.append(Term("M", name, unit))
        return tuple(out)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """m in kg, inertias in kg·m²."""
        return {name: properties[name] for name in _PLACES}
