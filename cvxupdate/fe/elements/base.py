"""What every element is to the rest of the package: terms (geometry) times coefficients
(properties).

An element matrix is a short sum ``K = Σ c(properties) · T(geometry)``. The geometry part is formed
once; a parameter only ever changes the scalars ``c``, so values and derivatives of any parameter
cost a few multiplications, and complex numbers pass through (complex-step differentiation, Squire
and Trapp 1998).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.surroundings import Surroundings
from cvxupdate.fe.terms import Real, Term, Values, rotate
from cvxupdate.spec.elements import ElementText

__all__ = [
    "Element",
    "ElementType",
    "Exact",
    "Given",
    "Placed",
    "Real",
    "Surroundings",
    "Term",
    "Values",
    "rotate",
]


@dataclass(frozen=True)
class Placed:
    """An element on the nodes of its row: its type, its own properties and its orientation
    vector."""

    kind: ElementType
    properties: Mapping[str, float]
    orientation: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Given:
    """A matrix on DOFs of its own: which of K, M, C, D, (node number, DOF kind 0..5) of each of its
    rows, and its entries (rows, rows)."""

    matrix: str
    labels: tuple[tuple[int, int], ...]
    values: sp.csr_array


class Exact(Protocol):
    """The dynamic stiffness of an element that depends on the frequency as it likes: Z(ω) = Σ z(ω,
    properties) · T(geometry), beside the K and M that are its Taylor series to ω²."""

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors, matrix "Z", as `Element.terms`."""

    def dynamic_stiffness(
        self, omega: complex | NDArray[np.complex128], properties: Mapping[str, Values]
    ) -> dict[str, Values]:
        """The scalar of every term at ``omega`` in rad/s, (elements,), complex; complex properties
        pass through. A complex ω = −is is Laplace's s."""

    def change(
        self,
        omega: complex | NDArray[np.complex128],
        properties: Mapping[str, Values],
        moves: Mapping[str, Real],
    ) -> dict[str, tuple[Values, Values]]:
        """The scalars and their derivatives where each property moves by ``moves`` (elements,) per
        unit."""

    def clamped_below(
        self, omega: Real, properties: Mapping[str, Values]
    ) -> dict[str, NDArray[np.int64]]:
        """How many natural frequencies of each element, undamped and with all of its nodes held,
        lie below its ``omega`` (rad/s, (elements,)), by what moves: the part of the terms' names
        before the dot."""


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
        with two nodes (between them) and for surfaces (that of
        the mesh)."""


class ElementType(Element, Protocol):
    """An element that a problem file may name: listed in `cvxupdate.fe.elements`, or registered."""

    text: ClassVar[ElementText]
    """What the problem file needs to know of the type."""
    brings: ClassVar[Mapping[str, str] | None]
    """DOF kind → the property without which an element brings no DOF there; None: it brings all."""

    @classmethod
    def from_row(cls, row: Any, block: Any, around: Surroundings) -> Iterable[Placed | Given]:
        """The elements of one row."""
