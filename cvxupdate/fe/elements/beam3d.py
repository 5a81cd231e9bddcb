"""Spatial beam: tension, torsion and bending about both axes (thesis 8.2)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.fe.beams import (
    IN_SPACE,
    beam_coefficients,
    beam_properties,
    beam_terms,
    beam_values,
    text_in_space,
)
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.sections import Section, shape_of
from cvxupdate.spec import division
from cvxupdate.spec.elements import ElementText, LineBlock, LineRow


@dataclass(frozen=True)
class Beam3D:
    """Twelve DOFs, Euler–Bernoulli; ``shear`` = 1 makes it Timoshenko (K and M), ``N`` adds the
    geometric stiffness of a preload."""

    section: Section
    mass: str = "consistent"
    rotary_inertia: bool = True
    polar_inertia: str = "Iy+Iz"
    name: str = "beam3d"
    nodes: int = 2
    dofs: tuple[str, ...] = IN_SPACE
    text: ClassVar[ElementText] = text_in_space(LineBlock, divide=division.line)
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: LineRow, block: LineBlock, around: Surroundings) -> Iterator[Placed]:
        """One beam."""
        shape = shape_of(around.section(row))
        kind = cls(shape, block.mass, block.rotary_inertia, block.polar_inertia)
        yield Placed(kind, beam_values(row, block, around), row.orientation or (0.0, 0.0, 0.0))

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions, section factors, and the physics that is zero unless asked for."""
        return beam_properties(self.section)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors in global axes."""
        return beam_terms(
            xyz, orientation, ("y", "z"), self.mass == "lumped", self.rotary_inertia, torsion=True
        )

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Section stiffnesses and masses per length."""
        return beam_coefficients(self.section, properties, self.polar_inertia)
