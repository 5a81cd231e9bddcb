"""Exact beam in space: no mesh error at any frequency (thesis 8.6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from cvxupdate.fe.beams import beam_coefficients, beam_lacking, beam_terms
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.exact.beam import ExactBeam
from cvxupdate.fe.sections import FACTORS, Section, line_properties, shape_of
from cvxupdate.keys import Table, Text, Vector
from cvxupdate.spec.elements import BENDING, Block, ElementText, Group, LineRow


class ExactBlock(Block):
    """Beams in space by their differential equation: one element for a whole prismatic member,
    whatever the frequency (Timoshenko where the section has `kappa`, else Rayleigh, or
    Euler–Bernoulli without `rotary_inertia`)."""

    type: Literal["exact_beam"]
    rows: Annotated[tuple[LineRow, ...], Table()] = Field(min_length=1, description="the elements")
    rotary_inertia: bool = Field(default=True, description="whether sections resist turning")
    polar_inertia: Literal["Iy+Iz", "J"] = Field(
        default="Iy+Iz",
        description="what turns about the axis: rho (Iy + Iz), or rho J as in (8.14)",
    )
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    orientation: Vector | None = Field(default=None, description="for every row without its own")
    group: Group = None


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
    dofs: tuple[str, ...] = ("x", "y", "z", "rx", "ry", "rz")
    text: ClassVar[ElementText] = ElementText(
        ExactBlock,
        changes=BENDING,
        outline="line",
        sections={"rectangle": (), "circle": (), "general": (("A",), ("Iy",), ("Iz",), ("J",))},
        lacking=beam_lacking,
        exact=_exact,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: LineRow, block: ExactBlock, around: Surroundings) -> Iterator[Placed]:
        """One beam."""
        shape = shape_of(around.section(row))
        kind = cls(shape, block.rotary_inertia, block.polar_inertia)
        yield Placed(kind, line_properties(row, around), row.orientation or (0.0, 0.0, 0.0))

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions, section factors, and the physics that is zero unless asked for."""
        return ("E", "nu", "G", "rho", *self.section.properties, *FACTORS, "N", "shear", "kappa")

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors of K and M in global axes."""
        return beam_terms(xyz, orientation, ("y", "z"), False, self.rotary_inertia, torsion=True)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Section stiffnesses and masses per length."""
        return beam_coefficients(self.section, properties, self.polar_inertia)
