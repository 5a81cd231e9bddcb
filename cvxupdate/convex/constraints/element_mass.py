"""Every element keeps a positive mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..context import Key
from .clauses import Clause, LinearClause, positions


@dataclass(frozen=True)
class ElementMass:
    """p ≥ −1 + keep for mass p-values: a sum of positive element masses is positive definite,
    whatever else happens."""

    names: tuple[str, ...]
    keep: float = 1e-3
    keys: ClassVar[Mapping[str, Key]] = {}

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per mass parameter."""
        low, high = np.array([self.keep - 1.0]), np.array([np.inf])
        return tuple(
            LinearClause(f"element mass of {name} stays positive", (i,), np.ones((1, 1)), low, high)
            for name, i in zip(
                self.names, positions(self.names, columns, "element mass"), strict=True
            )
        )
