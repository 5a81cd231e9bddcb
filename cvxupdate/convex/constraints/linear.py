"""Linear equalities and inequalities between named parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Part

from ...errors import InputError
from ..context import Context, Key
from .clauses import Clause, LinearClause, positions


class LinearTable(Part):
    """A linear clause, Σ a_i p_i = or ≤ or ≥ a number."""

    coefficients: Annotated[dict[str, float], Field(min_length=1)] = Field(
        description="a_i by name of the parameter"
    )
    equals: float | None = Field(default=None, description="right-hand side")
    at_most: float | None = Field(default=None, description="upper limit")
    at_least: float | None = Field(default=None, description="lower limit")


LINEAR = Key(LinearTable, "linear clauses", True)


def _row(
    coefficients: Mapping[str, float],
    columns: tuple[str, ...],
    lower: float,
    upper: float,
    name: str,
    unit: str,
) -> tuple[Clause, ...]:
    if not coefficients:
        raise InputError(f"{name}: names no parameter.")
    on = positions(tuple(coefficients), columns, name)
    C = np.array([list(coefficients.values())], dtype=float)
    return (LinearClause(name, on, C, np.array([float(lower)]), np.array([float(upper)]), unit),)


def sum_in_words(coefficients: Mapping[str, float], limit: int = 4) -> str:
    """A weighted sum of parameters in words, e.g. ``"2 a.E - b.E"``."""
    terms = [
        f"{'-' if c < 0 else '+'} {'' if abs(c) == 1 else f'{abs(c):g} '}{name}"
        for name, c in coefficients.items()
    ]
    shown = " ".join(terms[:limit]).removeprefix("+ ")
    return shown if len(terms) <= limit else f"{shown} + {len(terms) - limit} more terms"


@dataclass(frozen=True)
class LinearEquality:
    """Σ coefficient · parameter = value; ``label`` names the clause, else it is written out."""

    coefficients: Mapping[str, float]
    value: float
    label: str = ""
    unit: str = ""
    keys: ClassVar[Mapping[str, Key]] = {"linear": LINEAR}

    @classmethod
    def from_spec(cls, table: LinearTable, context: Context) -> LinearEquality | None:
        """The equation of a table that gives ``equals``."""
        return None if table.equals is None else cls(table.coefficients, table.equals)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause of one row."""
        name = self.label or f"{sum_in_words(self.coefficients)} = {self.value:g}"
        return _row(self.coefficients, columns, self.value, self.value, name, self.unit)


@dataclass(frozen=True)
class LinearInequality:
    """lower ≤ Σ coefficient · parameter ≤ upper, either side open by default; ``label`` names the
    clause."""

    coefficients: Mapping[str, float]
    lower: float = -np.inf
    upper: float = np.inf
    label: str = ""
    unit: str = ""
    keys: ClassVar[Mapping[str, Key]] = {"linear": LINEAR}

    @classmethod
    def from_spec(cls, table: LinearTable, context: Context) -> LinearInequality | None:
        """The limits of a table that gives ``at_least``, ``at_most`` or both."""
        if table.equals is not None:
            return None
        return cls(
            table.coefficients,
            -np.inf if table.at_least is None else table.at_least,
            np.inf if table.at_most is None else table.at_most,
        )

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause of one row."""
        total = sum_in_words(self.coefficients)
        if self.lower == -np.inf:
            words = f"{total} at most {self.upper:g}"
        elif self.upper == np.inf:
            words = f"{total} at least {self.lower:g}"
        else:
            words = f"{total} from {self.lower:g} to {self.upper:g}"
        return _row(
            self.coefficients, columns, self.lower, self.upper, self.label or words, self.unit
        )
