"""Spatial beam: tension, torsion and bending about both axes (thesis 8.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cvxupdate.fe.beams import beam_coefficients, beam_terms
from cvxupdate.fe.elements.base import Real, Term, Values
from cvxupdate.fe.sections import FACTORS, Section


@dataclass(frozen=True)
class Beam3D:
    """Twelve DOFs, Euler–Bernoulli; ``shear`` = 1 makes it Timoshenko (K and M), ``N`` adds the
    geometric stiffness of a preload."""

    section: Section
    mass: str = "consistent"
    rotary_inertia: bool = True
    name: str = "beam3d"
    nodes: int = 2
    dofs: tuple[str, ...] = ("x", "y", "z", "rx", "ry", "rz")

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions, section factors, and the physics that is zero unless asked for."""
        return ("E", "nu", "rho", *self.section.properties, *FACTORS, "N", "shear", "kappa")

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors in global axes."""
        return beam_terms(
            xyz, orientation, ("y", "z"), self.mass == "lumped", self.rotary_inertia, torsion=True
        )

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Section stiffnesses and masses per length."""
        return beam_coefficients(self.section, properties)
