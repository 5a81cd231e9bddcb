"""Gyroscopic moment of what spins: a velocity term that does no work, G = −Gᵀ, beside the beam or
mass that carries the inertia.

A polar inertia I that spins at Ω about a unit axis e has the angular momentum I Ω e. Turned by a
small θ it is I Ω (e + θ × e), and its rate is the moment I Ω (θ' × e): about x, M_y = I Ω θ'_z and
M_z = −I Ω θ'_y (Friswell, Penny, Garvey and Lees 2010, 5.3). Along a shaft it is the integral of
the same over its slopes, with I = ρ (Iy + Iz) a metre.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values, rotate
from cvxupdate.fe.hermite import unit_matrices
from cvxupdate.fe.triads import line_triads
from cvxupdate.keys import NonNegative, Table, Vector
from cvxupdate.spec.elements import Block, ElementText, Group, Lacking, OneOrTwoNodes, Row


class GyroscopicRow(Row):
    """The gyroscopic moment of what spins, beside the mass or beam that carries the inertia."""

    nodes: OneOrTwoNodes = Field(description="[i] is a disc, [i, j] a piece of shaft")
    Ip: NonNegative = Field(
        description="polar moment of inertia: of a disc [kg·m²], of a shaft for each metre [kg·m] "
        "(density times Iy + Iz)"
    )
    omega: float = Field(
        description="spin [rad/s], right-handed about the axis; a shaft's axis runs from i to j"
    )
    axis: Vector | None = Field(default=None, description="axis of a disc [x, y, z]")
    group: Group = None


class GyroscopicBlock(Block):
    """What spins: a skew-symmetric velocity term."""

    type: Literal["gyroscopic"]
    rows: Annotated[tuple[GyroscopicRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    Ip: NonNegative | None = Field(default=None, description="for every row without its own")
    omega: float | None = Field(default=None, description="for every row without its own")
    axis: Vector | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _lacking(block: GyroscopicBlock, active: tuple[str, ...]) -> Lacking:
    if len({"rx", "ry", "rz"}.intersection(active)) >= 2:
        return None
    return (
        "a gyroscopic moment couples two rotations.",
        "Add both rotations square to the axis to model.dofs.",
    )


@dataclass(frozen=True)
class Gyroscopic:
    """A disc at a node (``nodes`` 1; its axis is the orientation vector) or a piece of shaft (2;
    its axis runs from the first node to the second)."""

    nodes: int
    name: str = "gyroscopic"
    properties: tuple[str, ...] = ("Ip", "omega")
    text: ClassVar[ElementText] = ElementText(
        GyroscopicBlock, changes=("Ip", "omega"), outline="line", joins=False, lacking=_lacking
    )
    brings: ClassVar[Mapping[str, str] | None] = {}  # it acts on what beams and masses have

    @classmethod
    def from_row(
        cls, row: GyroscopicRow, block: GyroscopicBlock, around: Surroundings
    ) -> Iterator[Placed]:
        """One disc or piece of shaft."""
        axis = row.axis or (0.0, 0.0, 0.0)
        yield Placed(cls(len(row.nodes)), {"Ip": row.Ip, "omega": row.omega}, axis)

    @property
    def dofs(self) -> tuple[str, ...]:
        """The rotations of a disc, all DOFs of a shaft."""
        return ("rx", "ry", "rz") if self.nodes == 1 else ("x", "y", "z", "rx", "ry", "rz")

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """The moment of a unit angular momentum (a disc) or of one a metre (a shaft), in global
        axes."""
        return (Term("C", "h", _disc(orientation) if self.nodes == 1 else _shaft(xyz)),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Angular momentum Ip Ω: Ip in kg·m² (a disc) or kg·m (a shaft), Ω in rad/s."""
        return {"h": properties["Ip"] * properties["omega"]}


def _disc(axis: Real) -> Real:
    """−[e]×, (e, 3, 3)."""
    e = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    out = np.zeros((len(e), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, j, k], out[:, k, j] = e[:, i], -e[:, i]
    return out


def _shaft(xyz: Real) -> Real:
    """∫ (v'ᵀ w' − w'ᵀ v') dx with cubic deflections, (e, 12, 12); θy = −w', θz = v'."""
    L = np.linalg.norm(xyz[:, 1] - xyz[:, 0], axis=1)
    v, w = np.ones((len(L), 4)), np.ones((len(L), 4))
    v[:, 1::2], w[:, 1::2] = L[:, None], -L[:, None]
    local = np.zeros((len(L), 12, 12))
    cross = v[:, :, None] * w[:, None, :] * unit_matrices()["R0"] / L[:, None, None]
    across, up = (1, 5, 7, 11), (2, 4, 8, 10)
    local[np.ix_(range(len(L)), across, up)] = cross
    local[np.ix_(range(len(L)), up, across)] = -np.swapaxes(cross, 1, 2)
    return rotate(local, line_triads(xyz, np.zeros((len(L), 3))), 4)
