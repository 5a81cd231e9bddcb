"""What constraints and regularisers are made from: a table of the problem file, and a context that
answers for the model.

The convex step knows no model. A constraint asks the context for names, rows and matrices; whoever
owns the model answers, and computes nothing that no constraint asks for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from cvxupdate.keys import Part

from ..system import Array


@dataclass(frozen=True)
class Key:
    """A key of [constraints]: the model of its table, what it means in a line for the docs, and
    whether it is a list of tables (``many``). One that is ``always`` read gets None where the file
    does not have it."""

    table: type[Part]
    meaning: str
    many: bool = False
    always: bool = False


@dataclass(frozen=True, eq=False)
class MassLaw:
    """The total mass over the parameters: ``derivative`` (n,) kg per unit at p = 0, ``base`` kg,
    ``linear`` whether the derivative stays what it is."""

    derivative: Array
    base: float
    linear: bool


@dataclass(frozen=True, eq=False)
class RigidBody:
    """The structure without supports as a rigid body.

    ``inertia(centre)`` gives its matrix about a point (3,), (6, 6) in kg, kg m, kg m², and the
    derivatives by the parameters, (n, 6, 6). ``directed`` is True where the mass may differ from
    direction to direction, as in whole matrices.
    """

    inertia: Callable[[Array], tuple[Array, Array]]
    directed: bool


@dataclass(frozen=True, eq=False)
class ModeRows:
    """Equation of motion of a measured mode, A p = b in its standard deviations, and its name."""

    A: Array
    b: Array
    name: str


@dataclass(frozen=True, eq=False)
class FamilyBlocks:
    """A family of element matrices: N + P relative to the nominal one, block diagonal.

    ``columns`` are the parameters of ``entries`` (i ≤ j), those beside the diagonal divided by √2;
    ``classes`` the rows of each block, ``nominal`` the diagonal of N. ``bodies`` are, of families
    of mass, (today (6, 6), derivatives (entries, 6, 6)) of the rigid-body mass matrix of every
    different element, lengths in its own.
    """

    name: str
    columns: tuple[str, ...]
    entries: tuple[tuple[int, int], ...]
    classes: tuple[tuple[int, ...], ...]
    nominal: Array
    bodies: tuple[tuple[Array, Array], ...] = ()


class Context(Protocol):
    """What may be asked of the model; each answer is computed on request.

    Methods raise InputError where the model has no answer.
    """

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the n parameters."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the parameters, (n,) each, ±inf where open."""

    def changing(self, *of: str) -> tuple[str, ...]:
        """Names of the parameters that change one of these properties."""

    def absent(self) -> tuple[str, ...]:
        """Names of the parameters whose property or entry is 0 in the model."""

    def neighbours(self) -> tuple[tuple[str, str], ...]:
        """Pairs of parameters of one property whose elements share a node."""

    def coupled(self) -> tuple[tuple[str, str], ...]:
        """Pairs of parameters of one property whose elements share a free DOF's node."""

    def mirror_images(self, plane: str, at: float) -> tuple[tuple[str, ...], ...]:
        """Pairs of parameters whose elements are mirror images in the plane ``plane`` = ``at``."""

    def inside(self, groups: Sequence[str], of: str) -> tuple[str, ...]:
        """Names of the parameters of one property whose elements lie in these element groups."""

    def unsymmetric(self) -> tuple[str, ...]:
        """Whole matrices whose entries (i, j) and (j, i) are two parameters."""

    def whole(self) -> tuple[str, ...]:
        """Whole matrices that are parameters, entry by entry."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the N free DOFs."""

    def mass(self) -> MassLaw:
        """The total mass."""

    def matrix(self, name: str, asked_by: str) -> tuple[Any, tuple[Any, ...]]:
        """ "K" or "M" at p = 0 and its derivative by every parameter, sparse (N, N); an error names
        ``asked_by`` where the matrix is not linear in the parameters."""

    def free_motions(self) -> Array:
        """Motions (N, k) that the stiffness does not resist at p = 0."""

    def pins(self, motions: Array) -> Any:
        """DOFs to hold so that motions (N, k) are held in a statically determinate way, (k,)."""

    def body(self) -> RigidBody:
        """The structure without its supports as a rigid body."""

    def families(self) -> tuple[FamilyBlocks, ...]:
        """Families of element matrices among the parameters."""

    def mode(self, number: int, exactly: bool) -> ModeRows:
        """The equation of motion of the measured mode ``number`` (1 = first)."""
