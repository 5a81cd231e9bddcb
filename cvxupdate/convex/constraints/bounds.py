"""Bounds on each parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Part

from ...errors import InputError
from ...system import Array
from ..context import Context, Key
from .clauses import Clause, LinearClause


class BoundsTable(Part):
    """Bounds on every p that has none of its own."""

    lower: float | None = Field(default=None, description="lowest p")
    upper: float | None = Field(default=None, description="highest p")


@dataclass(frozen=True, eq=False)
class Bounds:
    """lower ≤ p ≤ upper, each a number for all parameters or an array (n,); ±inf leaves a side
    open."""

    lower: Array | float
    upper: Array | float
    keys: ClassVar[Mapping[str, Key]] = {
        "bounds": Key(BoundsTable, "bounds on every p", always=True)
    }

    @classmethod
    def from_spec(cls, table: BoundsTable | None, context: Context) -> Bounds:
        """The bounds of the parameters: their own, else those of the table (they have them
        already)."""
        return cls(*context.bounds)

    def limits(self, n: int) -> tuple[Array, Array]:
        """The two limits as arrays (n,)."""
        try:
            return (
                np.array(np.broadcast_to(np.asarray(self.lower, dtype=float), (n,))),
                np.array(np.broadcast_to(np.asarray(self.upper, dtype=float), (n,))),
            )
        except ValueError:
            raise InputError(
                f"bounds: {np.size(self.lower)} lower and {np.size(self.upper)} upper limits "
                f"were given for {n} parameters; give one of each, or {n}."
            ) from None

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause for each parameter that has a finite limit."""
        lower, upper = self.limits(len(columns))
        one = np.ones((1, 1))
        return tuple(
            LinearClause(
                f"bounds on {name}: {_words(lo, hi)}", (i,), one, lower[i : i + 1], upper[i : i + 1]
            )
            for i, (name, lo, hi) in enumerate(zip(columns, lower, upper, strict=True))
            if not (lo == -np.inf and hi == np.inf)
        )


def _words(lower: float, upper: float) -> str:
    if lower == -np.inf:
        return f"at most {upper:g}"
    if upper == np.inf:
        return f"at least {lower:g}"
    return f"{lower:g} to {upper:g}" if lower != upper else f"held at {lower:g}"
