"""Neighbouring parameters differ little."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import NonNegative, Part

from ...errors import InputError
from ..context import Context, Key
from .clauses import Clause, LinearClause, positions


class SmoothnessTable(Part):
    """Parameters of elements that share a node differ little."""

    at_most: NonNegative = Field(description="largest difference of neighbours")


@dataclass(frozen=True)
class Smooth:
    """|p_a − p_b| ≤ at_most for every pair of names: neighbours along a beam or on a plate."""

    pairs: tuple[tuple[str, str], ...]
    at_most: float
    keys: ClassVar[Mapping[str, Key]] = {
        "smoothness": Key(SmoothnessTable, "smoothness along neighbours")
    }

    @classmethod
    def from_spec(cls, table: SmoothnessTable, context: Context) -> Smooth:
        """All pairs of neighbours.

        Raises
        ------
        InputError
            When there is none.
        """
        pairs = context.neighbours()
        if not pairs:
            raise InputError(
                "constraints.smoothness: no two parameters of one property have elements that "
                "share a node. Leave the clause out."
            )
        return cls(pairs, table.at_most)

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
