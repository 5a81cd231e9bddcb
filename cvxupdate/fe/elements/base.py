"""What every element is to the rest of the package: terms (geometry) times coefficients
(properties).

An element matrix is a short sum ``K = Σ c(properties) · T(geometry)``. The geometry part is formed
once; a parameter only ever changes the scalars ``c``, so values and derivatives of any parameter
cost a few multiplications, and complex numbers pass through (complex-step differentiation, Squire
and Trapp 1998).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from cvxupdate.fe.terms import Real, Term, Values, rotate

__all__ = ["Element", "Real", "Term", "Values", "rotate"]


class Element(Protocol):
    """The interface of an element type; `Block` holds the elements themselves.

    ``dofs`` are the DOF kinds of one node, in order; ``nodes`` the number of nodes; ``properties``
    the names a parameter may act on.
    """

    @property
    def name(self) -> str:
        """The word of the problem file."""

    @property
    def nodes(self) -> int:
        """Number of nodes."""

    @property
    def dofs(self) -> tuple[str, ...]:
        """DOF kinds at each node."""

    @property
    def properties(self) -> tuple[str, ...]:
        """Property names, each with one value per element."""

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors for node coordinates (elements, nodes, 3) and orientation vectors
        (elements, 3), in global axes."""

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Scalars of every term, each (elements,); ``length`` is among ``properties`` for elements
        with two nodes."""
