"""Exact beam in space: no mesh error at any frequency (thesis 8.6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from cvxupdate.fe.beams import (
    IN_SPACE,
    beam_coefficients,
    beam_properties,
    beam_terms,
    beam_values,
    text_in_space,
)
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.exact.beam import ExactBeam
from cvxupdate.fe.sections import Section, shape_of
from cvxupdate.spec.elements import ElementText, LineKeys, LineRow


class ExactBlock(LineKeys):
    """Beams in space by their differential equation: one element for a whole prismatic member,
    whatever the frequency (Timoshenko where the section has `kappa`, else Rayleigh, or
    Euler–Bernoulli without `rotary_inertia`)."""

    type: Literal["exact_beam"]


def _exact(kind: Any) -> ExactBeam:
    return ExactBeam(kind.section, kind.rotary_inertia, kind.polar_inertia)


@dataclass(frozen=True)
class ExactBeam3D:
    """Twelve DOFs. K and M are its Taylor series to ω², which are those of a `beam3d` between the
    same nodes; `fe.exact` has the whole."""

    section: Section
    rotary_inertia: bool = True
    polar_inertia: str = "Iy+Iz"
    name: str = "exact_beam"
    nodes: int = 2
    dofs: tuple[str, ...] = IN_SPACE
    text: ClassVar[ElementText] = text_in_space(ExactBlock, exact=_exact)
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: LineRow, block: ExactBlock, around: Surroundings) -> Iterator[Placed]:
        """One beam."""
        shape = shape_of(around.section(row))
        kind = cls(shape, block.rotary_inertia, block.polar_inertia)
        yield Placed(kind, beam_values(row, block, around), row.orientation or (0.0, 0.0, 0.0))

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions, section factors, and the physics that is zero unless asked for."""
        return beam_properties(self.section)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors of K and M in global axes."""
        return beam_terms(xyz, orientation, ("y", "z"), False, self.rotary_inertia, torsion=True)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Section stiffnesses and masses per length."""
        return beam_coefficients(self.section, properties, self.polar_inertia)
