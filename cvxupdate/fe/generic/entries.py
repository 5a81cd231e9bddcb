"""The kind of block that holds entries of X and S: changes of element matrices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cvxupdate.fe.elements.base import Real, Term, Values


@dataclass(frozen=True)
class GenericChange:
    """Entries of X (``matrix`` "K") or S ("M") of ``elements``, one for each row of its block: a
    change that is zero today, or what a member of a family already differs by."""

    matrix: str
    entries: tuple[tuple[int, int], ...]
    elements: tuple[int, ...]
    name: str = "generic"
    nodes: int = 0
    dofs: tuple[str, ...] = ()

    @property
    def properties(self) -> tuple[str, ...]:
        """One for each entry."""
        return tuple(entry_name(self.matrix, i, j) for i, j in self.entries)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the terms come from the elements' own matrices."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """The changes."""
        return {name: properties[name] for name in self.properties}


def entry_name(matrix: str, i: int, j: int) -> str:
    """ "K[1,5]", of modes counted from 0."""
    return f"{matrix}[{i + 1},{j + 1}]"
