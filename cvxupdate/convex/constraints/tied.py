"""Parameters tied together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Part, Text

from ...errors import InputError
from ..context import Context, Key
from .clauses import Clause, LinearClause, positions, shortened


class TiedTable(Part):
    """Parameters that share one value."""

    parameters: Annotated[tuple[Text, ...], Field(min_length=2)] = Field(
        description="names of at least two parameters"
    )


@dataclass(frozen=True)
class Tied:
    """Within each group of parameter names, all parameters are equal (macro elements, mirror
    symmetry)."""

    groups: tuple[tuple[str, ...], ...]
    keys: ClassVar[Mapping[str, Key]] = {"tied": Key(TiedTable, "tied parameters", True)}

    @classmethod
    def from_spec(cls, table: TiedTable, context: Context) -> Tied:
        """One group."""
        return cls((table.parameters,))

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
