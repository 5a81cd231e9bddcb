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
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.spec.elements import ElementText
from cvxupdate.spec.model import Material, Model, Section

Real = NDArray[np.float64]
Values = NDArray[Any]  # real, or complex while a derivative is taken


@dataclass(frozen=True)
class Term:
    """One geometric factor: ``matrix`` is "K", "M" or "C", ``coefficient`` names its scalar,
    ``values`` is (elements, d, d)."""

    matrix: str
    coefficient: str
    values: Real


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


@dataclass(frozen=True)
class Surroundings:
    """What a row may name: the text of the model, and the folder of the problem file."""

    text: Model
    folder: Path

    @property
    def active(self) -> tuple[str, ...]:
        """The active DOF kinds."""
        return tuple(self.text.dofs)

    def material(self, row: Any) -> Material:
        """The material of a row."""
        return self.text.materials[row.material]

    def section(self, row: Any) -> Section:
        """The section of a row."""
        return self.text.sections[row.section]


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


class ElementType(Element, Protocol):
    """An element that a problem file may name: listed in `cvxupdate.fe.elements`, or registered."""

    text: ClassVar[ElementText]
    """What the problem file needs to know of the type."""
    brings: ClassVar[Mapping[str, str] | None]
    """DOF kind → the property without which an element brings no DOF there; None: it brings all."""

    @classmethod
    def from_row(cls, row: Any, block: Any, around: Surroundings) -> Iterable[Placed | Given]:
        """The elements of one row."""


def rotate(local: Real, triads: Real, blocks: int) -> Real:
    """Rotate local matrices (e, 3·blocks, 3·blocks) by triads (e, 3, 3) whose rows are the local
    axes: Rᵀ k R, block by block."""
    e = local.shape[0]
    split = local.reshape(e, blocks, 3, blocks, 3)
    return np.asarray(
        np.einsum("eki,eakbl,elj->eaibj", triads, split, triads, optimize=True).reshape(local.shape)
    )
