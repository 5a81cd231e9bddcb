"""Brick of twenty nodes: quadratic (serendipity) displacements, fully integrated (Zienkiewicz and
Taylor)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.elements.solid_rows import SolidBlock, SolidRow, solid_lacking, solid_properties
from cvxupdate.fe.solids import brick_rule, lame, solid_terms
from cvxupdate.spec.elements import ELASTIC, INERTIAL, ElementText
from cvxupdate.spec.solids import HEX20, divide_brick, inspect


@dataclass(frozen=True)
class Hex20:
    """Corners, then the middles of the edges below, above, and upright."""

    mass: str = "consistent"
    name: str = "hex20"
    nodes: int = 20
    dofs: tuple[str, ...] = ("x", "y", "z")
    properties: tuple[str, ...] = ("E", "nu", "rho")
    text: ClassVar[ElementText] = ElementText(
        SolidBlock,
        changes=(*ELASTIC, *INERTIAL, "nu"),
        outline="solid",
        lacking=solid_lacking,
        divide=lambda nodes, parts: divide_brick(HEX20, parts),
        flaw=partial(inspect, HEX20),
        faces=HEX20.faces,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: SolidRow, block: SolidBlock, around: Surroundings) -> Iterator[Placed]:
        """One element."""
        properties = solid_properties(row, around)
        yield Placed(cls(mass=block.mass), properties)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors, (e, 60, 60)."""
        lumped = self.mass == "lumped"
        return solid_terms(HEX20, xyz, brick_rule(3), brick_rule(3), lumped, None)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Lamé's constants and the density."""
        return {**lame(properties["E"], properties["nu"]), "rho": properties["rho"]}
