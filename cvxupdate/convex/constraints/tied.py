"""Parameters tied together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .clauses import Clause, LinearClause, positions, shortened


@dataclass(frozen=True)
class Tied:
    """Within each group of parameter names, all parameters are equal (macro elements, mirror
    symmetry)."""

    groups: tuple[tuple[str, ...], ...]

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per group: each member equals the first."""
        made = []
        for group in self.groups:
            name = f"tied: {shortened(group, 4).replace(', ', ' = ')}"
            on = positions(group, columns, "tied")
            if len(set(on)) != len(on) or len(on) < 2:
                raise InputError(f"{name}: a tied group needs two or more different parameters.")
            rows = len(on) - 1
            C = np.hstack([np.full((rows, 1), -1.0), np.eye(rows)])
            made.append(LinearClause(name, on, C, np.zeros(rows), np.zeros(rows)))
        return tuple(made)
