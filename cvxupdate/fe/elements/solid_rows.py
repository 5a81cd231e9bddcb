"""Rows and blocks of solid elements, which all types share."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Surroundings
from cvxupdate.fe.sections import material_properties
from cvxupdate.keys import Id, Table, Text
from cvxupdate.spec.elements import (
    Block,
    Group,
    Lacking,
    MassKind,
    Row,
)
from cvxupdate.spec.factors import DampingFactor, Loss, MassFactor, StiffnessFactor

INCOMPRESSIBLE = 0.499
"""Poisson's ratio above which elements of displacements alone lock."""


class SolidRow(Row):
    """A brick or tetrahedron."""

    nodes: Annotated[tuple[Id, ...], Field(min_length=8, max_length=20)] = Field(
        description="corners, then nodes amid edges; the order is given below"
    )
    material: Text = Field(description="name of a material")
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None
    group: Group = None


class SolidBlock(Block):
    """Solids: bricks of 8 or 20 nodes, tetrahedra of 10."""

    type: Literal["hex8", "hex20", "tet10"]
    rows: Annotated[tuple[SolidRow, ...], Table()] = Field(min_length=1, description="the elements")
    mass: MassKind = "consistent"
    material: Text | None = Field(default=None, description="for every row without its own")
    group: Group = None


def solid_properties(row: SolidRow, around: Surroundings) -> dict[str, float]:
    """E, nu and rho.

    Raises
    ------
    ModelError
        For a material that does not give way in volume: λ is then infinite.
    """
    properties = material_properties(around.material(row))
    if properties["nu"] > INCOMPRESSIBLE:
        raise ModelError(
            f"element {row.id}: a Poisson's ratio of {properties['nu']:g} leaves a solid no change "
            f"of volume. Give one up to {INCOMPRESSIBLE:g}."
        )
    return properties


def solid_lacking(block: SolidBlock, active: tuple[str, ...]) -> Lacking:
    """Solids move along all three axes."""
    absent = [kind for kind in "xyz" if kind not in active]
    if not absent:
        return None
    return (
        f"{block.type} elements need x, y and z; {', '.join(absent)} not active.",
        "Add them to model.dofs.",
    )
