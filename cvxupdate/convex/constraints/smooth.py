"""Neighbouring parameters differ little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .clauses import Clause, LinearClause, positions


@dataclass(frozen=True)
class Smooth:
    """|p_a − p_b| ≤ at_most for every pair of names: neighbours along a beam or on a plate."""

    pairs: tuple[tuple[str, str], ...]
    at_most: float

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per pair."""
        if not self.at_most >= 0:
            raise InputError(f"smoothness: at_most {self.at_most} must be 0 or more.")
        limit = np.array([self.at_most])
        return tuple(
            LinearClause(
                f"neighbours {a} and {b} within {self.at_most:g}",
                positions((a, b), columns, "smoothness"),
                np.array([[1.0, -1.0]]),
                -limit,
                limit,
            )
            for a, b in self.pairs
        )
