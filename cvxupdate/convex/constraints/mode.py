"""A measured mode that the updated model must reproduce."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Count, Part, Positive

from ..context import Context, Key
from .clauses import Clause
from .equations import Equations


class ModeClause(Part):
    """A measured mode that the updated model must reproduce, shape included."""

    mode: Count = Field(description="number of the row among the fitted modes (1 = first)")
    within: Positive | None = Field(
        default=None, description="r.m.s. in its standard deviations; absent: exactly"
    )


@dataclass(frozen=True, eq=False)
class ReproducedMode:
    """The equation of motion of one mode, exactly or within its deviations (a second-order
    cone)."""

    equations: Equations
    keys: ClassVar[Mapping[str, Key]] = {"modes": Key(ModeClause, "modes to be reproduced", True)}

    @classmethod
    def from_spec(cls, table: ModeClause, context: Context) -> ReproducedMode:
        """The mode of one row of the table."""
        rows = context.mode(table.mode, table.within is None)
        if table.within is None:
            return cls(Equations(rows.A, rows.b, f"{rows.name} reproduced exactly"))
        share = 1.0 / np.sqrt(len(rows.b))
        label = f"{rows.name} reproduced within {table.within:g} standard deviations"
        return cls(Equations(share * rows.A, share * rows.b, label, table.within))

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause."""
        return self.equations.clauses(columns)
