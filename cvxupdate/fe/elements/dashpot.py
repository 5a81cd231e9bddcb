"""Dashpot: a viscous damper along one DOF, to ground or between two nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cvxupdate.fe.elements.base import Real, Term, Values
from cvxupdate.fe.elements.spring import pair


@dataclass(frozen=True)
class Dashpot:
    """Force c·(v₂ − v₁) along ``dof``, or c·v against ground where ``nodes`` is 1."""

    dof: str
    nodes: int
    name: str = "dashpot"
    properties: tuple[str, ...] = ("c",)

    @property
    def dofs(self) -> tuple[str, ...]:
        """The one kind of DOF it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit damping."""
        return (Term("C", "c", pair(len(xyz), self.nodes)),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """c in N·s/m or N·m·s/rad."""
        return {"c": properties["c"]}
