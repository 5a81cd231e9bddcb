"""Whole matrices as variables: which entries there are, symmetry, and connectivity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .clauses import Clause, LinearClause, positions


def entry_name(matrix: str, row: str, column: str) -> str:
    """The name of an entry of a whole matrix, e.g. ``"K[n1.x, n2.x]"``."""
    return f"{matrix}[{row}, {column}]"


@dataclass(frozen=True)
class Symmetric:
    """K_ij = K_ji for every pair of names (i, j), (j, i) among the parameters: one clause per
    matrix."""

    matrix: str
    labels: tuple[str, ...]

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause; none when no entry has its mirror image among the parameters."""
        known = {name: i for i, name in enumerate(columns)}
        pairs = []
        for i, a in enumerate(self.labels):
            for b in self.labels[i + 1 :]:
                one, other = entry_name(self.matrix, a, b), entry_name(self.matrix, b, a)
                if (one in known) != (other in known):
                    raise InputError(
                        f"symmetry of {self.matrix}: {one if one in known else other} is a "
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
        return (LinearClause(f"symmetry of {self.matrix}", on, C, nothing, nothing),)


@dataclass(frozen=True)
class Connectivity:
    """Named entries stay as they are (no element appears that was not there): one clause per
    entry."""

    entries: tuple[str, ...]

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per entry: its change is 0."""
        zero = np.zeros(1)
        return tuple(
            LinearClause(f"connectivity: no element at {name}", (i,), np.ones((1, 1)), zero, zero)
            for name, i in zip(
                self.entries, positions(self.entries, columns, "connectivity"), strict=True
            )
        )
