"""Brick of eight nodes with incompatible modes, so that it bends without locking (Taylor, Beresford
and Wilson 1976)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.elements.solid_rows import SolidBlock, SolidRow, solid_lacking, solid_properties
from cvxupdate.fe.solids import brick_rule, lame, solid_terms
from cvxupdate.spec.elements import ELASTIC, INERTIAL, ElementText
from cvxupdate.spec.solids import HEX8, divide_brick, inspect


@dataclass(frozen=True)
class Hex8:
    """``poisson`` is Poisson's ratio at which the incompatible modes are condensed: that of the row
    (`cvxupdate.fe.solids.enriched`)."""

    poisson: float = 0.3
    mass: str = "consistent"
    name: str = "hex8"
    nodes: int = 8
    dofs: tuple[str, ...] = ("x", "y", "z")
    properties: tuple[str, ...] = ("E", "nu", "rho")
    text: ClassVar[ElementText] = ElementText(
        SolidBlock,
        changes=(*ELASTIC, *INERTIAL, "nu"),
        outline="solid",
        lacking=solid_lacking,
        divide=lambda nodes, parts: divide_brick(HEX8, parts),
        flaw=partial(inspect, HEX8),
        faces=HEX8.faces,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: SolidRow, block: SolidBlock, around: Surroundings) -> Iterator[Placed]:
        """One element."""
        properties = solid_properties(row, around)
        yield Placed(cls(properties["nu"], mass=block.mass), properties)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors, (e, 24, 24)."""
        lumped = self.mass == "lumped"
        return solid_terms(HEX8, xyz, brick_rule(2), brick_rule(2), lumped, self.poisson)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Lamé's constants and the density."""
        return {**lame(properties["E"], properties["nu"]), "rho": properties["rho"]}
