"""Whole matrices as variables: which entries there are, symmetry, and connectivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cvxupdate.keys import Part

from ...errors import InputError
from ..context import Context, Key
from .clauses import Clause, LinearClause, positions


class SymmetryTable(Part):
    """Matrices stay symmetric: entries (i, j) and (j, i) of `update.whole` are equal. Elements are
    symmetric by themselves."""


class ConnectivityTable(Part):
    """No element appears that was not there: entries and properties that are 0 in the model stay
    0."""


def entry_name(matrix: str, row: str, column: str) -> str:
    """The name of an entry of a whole matrix, e.g. ``"K[n1.x, n2.x]"``."""
    return f"{matrix}[{row}, {column}]"


@dataclass(frozen=True)
class Symmetric:
    """K_ij = K_ji for every pair of names (i, j), (j, i) among the parameters, for each matrix
    named."""

    matrices: tuple[str, ...]
    labels: tuple[str, ...]
    keys: ClassVar[Mapping[str, Key]] = {"symmetry": Key(SymmetryTable, "matrices stay symmetric")}

    @classmethod
    def from_spec(cls, table: SymmetryTable, context: Context) -> Symmetric:
        """Every whole matrix; none where one parameter stands for both, as for every element."""
        return cls(context.unsymmetric(), context.labels)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per matrix; none when no entry has its mirror image among the parameters."""
        return tuple(clause for matrix in self.matrices for clause in self._of(matrix, columns))

    def _of(self, matrix: str, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        known = {name: i for i, name in enumerate(columns)}
        pairs = []
        for i, a in enumerate(self.labels):
            for b in self.labels[i + 1 :]:
                one, other = entry_name(matrix, a, b), entry_name(matrix, b, a)
                if (one in known) != (other in known):
                    raise InputError(
                        f"symmetry of {matrix}: {one if one in known else other} is a "
                        "parameter, its mirror image is not."
                    )
                if one in known:
                    pairs.append((known[one], known[other]))
        if not pairs:
            return ()
        on = tuple(sorted({i for pair in pairs for i in pair}))
        where = {i: k for k, i in enumerate(on)}
        C = np.zeros((len(pairs), len(on)))
        for r, (i, j) in enumerate(pairs):
            C[r, where[i]], C[r, where[j]] = 1.0, -1.0
        nothing = np.zeros(len(pairs))
        return (LinearClause(f"symmetry of {matrix}", on, C, nothing, nothing),)


@dataclass(frozen=True)
class Connectivity:
    """Named entries stay as they are (no element appears that was not there): one clause per
    entry."""

    entries: tuple[str, ...]
    keys: ClassVar[Mapping[str, Key]] = {"connectivity": Key(ConnectivityTable, "zeros stay zero")}

    @classmethod
    def from_spec(cls, table: ConnectivityTable, context: Context) -> Connectivity:
        """Everything that is 0 in the model."""
        return cls(context.absent())

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per entry: its change is 0."""
        zero = np.zeros(1)
        return tuple(
            LinearClause(f"connectivity: no element at {name}", (i,), np.ones((1, 1)), zero, zero)
            for name, i in zip(
                self.entries, positions(self.entries, columns, "connectivity"), strict=True
            )
        )
