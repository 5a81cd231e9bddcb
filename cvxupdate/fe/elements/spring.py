"""Spring: a stiffness along one DOF, to ground or between two nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.elements.base import Real, Term, Values


@dataclass(frozen=True)
class Spring:
    """Force k·(u₂ − u₁) along ``dof``, or k·u against ground where ``nodes`` is 1."""

    dof: str
    nodes: int
    name: str = "spring"
    properties: tuple[str, ...] = ("k",)

    @property
    def dofs(self) -> tuple[str, ...]:
        """The one kind of DOF it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit stiffness."""
        return (Term("K", "k", pair(len(xyz), self.nodes)),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """k in N/m or N·m/rad."""
        return {"k": properties["k"]}


def pair(elements: int, nodes: int) -> Real:
    """[[1]] or [[1, −1], [−1, 1]] for each element."""
    unit = np.ones((1, 1)) if nodes == 1 else np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.broadcast_to(unit, (elements, *unit.shape))
