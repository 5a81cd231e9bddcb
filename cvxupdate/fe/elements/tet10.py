"""Tetrahedron of ten nodes: quadratic displacements, linear strains where its edges are straight
(Zienkiewicz and Taylor)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.elements.solid_rows import SolidBlock, SolidRow, solid_lacking, solid_properties
from cvxupdate.fe.solids import lame, solid_terms, tetrahedron_rule
from cvxupdate.spec.elements import ELASTIC, INERTIAL, ElementText
from cvxupdate.spec.solids import TET10, divide_tetrahedron, inspect


@dataclass(frozen=True)
class Tet10:
    """Corners, then the middles of edges 1-2, 2-3, 3-1, 1-4, 2-4, 3-4."""

    mass: str = "consistent"
    name: str = "tet10"
    nodes: int = 10
    dofs: tuple[str, ...] = ("x", "y", "z")
    properties: tuple[str, ...] = ("E", "nu", "rho")
    text: ClassVar[ElementText] = ElementText(
        SolidBlock,
        changes=(*ELASTIC, *INERTIAL, "nu"),
        outline="solid",
        lacking=solid_lacking,
        divide=lambda nodes, parts: divide_tetrahedron(TET10, parts),
        flaw=partial(inspect, TET10),
        faces=TET10.faces,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: SolidRow, block: SolidBlock, around: Surroundings) -> Iterator[Placed]:
        """One element."""
        properties = solid_properties(row, around)
        yield Placed(cls(mass=block.mass), properties)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors, (e, 30, 30)."""
        lumped = self.mass == "lumped"
        return solid_terms(TET10, xyz, tetrahedron_rule(2), tetrahedron_rule(3), lumped, None)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Lamé's constants and the density."""
        return {**lame(properties["E"], properties["nu"]), "rho": properties["rho"]}
