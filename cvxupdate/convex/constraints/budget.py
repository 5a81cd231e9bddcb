"""A budget on the change of the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from cvxupdate.keys import NonNegative, Part

from ...errors import InputError
from ...system import Array
from ..context import Context, Key
from .clauses import Clause, ConicClause
from .norm_at_most import NormAtMost


class BudgetTable(Part):
    """A budget on the whole change."""

    at_most: NonNegative = Field(description="largest norm of p")
    norm: Literal["l1", "l2"] = Field(
        default="l2", description="l2: root of the sum of squares; l1: sum of absolute values"
    )


@dataclass(frozen=True, eq=False)
class Budget:
    """‖p / scale‖ ≤ at_most, with the norm "l2" (energy of the change) or "l1" (its total)."""

    at_most: float
    norm: str = "l2"
    scale: Array | float = 1.0
    keys: ClassVar[Mapping[str, Key]] = {"budget": Key(BudgetTable, "budget on the change")}

    @classmethod
    def from_spec(cls, table: BudgetTable, context: Context) -> Budget:
        """As the table says."""
        return cls(table.at_most, table.norm)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause over all parameters."""
        n = len(columns)
        if self.norm not in ("l1", "l2") or not self.at_most >= 0:
            raise InputError(
                f'budget: norm {self.norm!r} must be "l1" or "l2", and at_most '
                f"({self.at_most}) 0 or more."
            )
        weight = 1.0 / np.array(np.broadcast_to(np.asarray(self.scale, dtype=float), (n,)))
        if self.norm == "l2":
            label = f"budget: root of the sum of squared changes at most {self.at_most:g}"
            return NormAtMost(np.diag(weight), np.zeros(n), self.at_most, label).clauses(columns)

        def constraints(p: Any, slack: Any) -> Sequence[Any]:
            import cvxpy as cp

            return [cp.norm1(cp.multiply(weight, p)) <= self.at_most + slack]

        return (
            ConicClause(
                f"budget: sum of absolute changes at most {self.at_most:g}",
                constraints,
                lambda p: self.at_most - float(np.abs(weight * p).sum()),
            ),
        )
