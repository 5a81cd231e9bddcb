"""Rod: axial stiffness only, two or three translations at each node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values, rotate
from cvxupdate.fe.sections import FACTORS, Section, line_properties, section_constants, shape_of
from cvxupdate.fe.triads import line_triads
from cvxupdate.spec import division
from cvxupdate.spec.elements import (
    ELASTIC,
    INERTIAL,
    SIZES,
    ElementText,
    LineBlock,
    LineRow,
    translation_lacking,
)


@dataclass(frozen=True)
class Rod:
    """E A / L along the bar; mass lumped (7.8) or consistent (ρ A L / 6 [2 1; 1 2] in every
    direction)."""

    section: Section
    mass: str = "consistent"
    name: str = "rod"
    nodes: int = 2
    dofs: tuple[str, ...] = ("x", "y", "z")
    text: ClassVar[ElementText] = ElementText(
        LineBlock,
        changes=(*ELASTIC, *INERTIAL, *SIZES),
        outline="line",
        divide=division.line,
        sections={"rectangle": (), "circle": (), "general": (("A",),)},
        lacking=translation_lacking,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: LineRow, block: LineBlock, around: Surroundings) -> Iterator[Placed]:
        """One rod."""
        kind = cls(shape_of(around.section(row)), block.mass)
        yield Placed(kind, line_properties(row, around), row.orientation or (0.0, 0.0, 0.0))

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions and the section factors."""
        return ("E", "rho", *self.section.properties, *FACTORS)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Axial projector and mass pattern."""
        e = len(xyz)
        length = np.linalg.norm(xyz[:, 1] - xyz[:, 0], axis=1)
        axial = np.zeros((e, 2, 3, 2, 3))
        axial[:, 0, 0, 0, 0] = axial[:, 1, 0, 1, 0] = 1.0
        axial[:, 0, 0, 1, 0] = axial[:, 1, 0, 0, 0] = -1.0
        K = rotate(axial.reshape(e, 6, 6), line_triads(xyz, orientation), 2) / length[:, None, None]
        pattern = (
            np.diag([0.5, 0.5])
            if self.mass == "lumped"
            else np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
        )
        M = np.kron(pattern, np.eye(3))[None] * length[:, None, None]
        return Term("K", "EA", K), Term("M", "rhoA", M)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """E·A in N, ρ·A in kg/m."""
        A = section_constants(self.section, properties)["A"]
        return {"EA": properties["E"] * A, "rhoA": properties["rho"] * A}
