"""Bounds on each parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...system import Array
from .clauses import Clause, LinearClause


@dataclass(frozen=True, eq=False)
class Bounds:
    """lower ≤ p ≤ upper, each a number for all parameters or an array (n,); ±inf leaves a side
    open."""

    lower: Array | float
    upper: Array | float

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
