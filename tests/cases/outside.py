"""Toy parts from outside the package: an element, a constraint, a regulariser and a reader, each
one class (or one function and its format) as CONTRIBUTING.md's recipes say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from cvxupdate.convex import Clause, Context, Key, LinearClause
from cvxupdate.errors import InputError, RecordingError
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.keys import NonNegative, Part, Positive, Table
from cvxupdate.recordings.read.contents import Contents, Format, Options
from cvxupdate.spec.elements import Block, ElementText, Group, Row, TwoNodes
from cvxupdate.system import Array


class StringRow(Row):
    """A taut string between two nodes."""

    nodes: TwoNodes = Field(description="[i, j]")
    tension: Positive = Field(description="tension [N]")
    line_mass: NonNegative = Field(default=0.0, description="mass a metre [kg/m]")
    group: Group = None


class StringBlock(Block):
    """Taut strings, which resist motion across their axis."""

    type: Literal["taut_string"]
    rows: Annotated[tuple[StringRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    tension: Positive | None = Field(default=None, description="for every row without its own")
    line_mass: NonNegative | None = Field(default=None, description="for every row without its own")
    group: Group = None


@dataclass(frozen=True)
class String:
    """K = T / L [1 −1; −1 1] along y; M = μ L / 6 [2 1; 1 2]."""

    name: str = "taut_string"
    nodes: int = 2
    dofs: tuple[str, ...] = ("y",)
    properties: tuple[str, ...] = ("tension", "line_mass")
    text: ClassVar[ElementText] = ElementText(
        StringBlock,
        changes=("stiffness", "mass", "tension", "line_mass"),
        units={"tension": "N", "line_mass": "kg/m"},
        outline="line",
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: StringRow, block: StringBlock, around: Surroundings) -> Iterator[Placed]:
        """One string."""
        yield Placed(cls(), {"tension": row.tension, "line_mass": row.line_mass})

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit tension and unit mass a metre."""
        length = np.linalg.norm(xyz[:, 1] - xyz[:, 0], axis=1)[:, None, None]
        across, along = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]])
        return Term("K", "T", across / length), Term("M", "mu", along * length / 6.0)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """T in N, μ in kg/m."""
        return {"T": properties["tension"], "mu": properties["line_mass"]}


class BalanceTable(Part):
    """The changes of two parameters cancel."""

    between: tuple[str, str] = Field(description="names of two parameters")


@dataclass(frozen=True)
class Balance:
    """p_a + p_b = 0."""

    pair: tuple[str, str]
    keys: ClassVar[Mapping[str, Key]] = {
        "balance": Key(BalanceTable, "changes that cancel", many=True)
    }

    @classmethod
    def from_spec(cls, table: BalanceTable, context: Context) -> Balance:
        """The pair of one table; InputError for a name that is no parameter."""
        unknown = set(table.between) - set(context.columns)
        if unknown:
            raise InputError(f"constraints.balance: no parameter is called {sorted(unknown)[0]}.")
        return cls(table.between)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause."""
        on, zero = tuple(columns.index(name) for name in self.pair), np.zeros(1)
        return (LinearClause(f"{' and '.join(self.pair)} cancel", on, np.ones((1, 2)), zero, zero),)


@dataclass(frozen=True, eq=False)
class Quartic:
    """weight · Σ (p / size)⁴."""

    weight: float
    size: float = 1.0
    name: ClassVar[str] = "quartic"
    keys: ClassVar[Mapping[str, Any]] = {
        "size": (Positive | None, Field(default=None, description="quartic: size of one unit"))
    }

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> Quartic:
        """With the size of the table."""
        return cls(table.weight, table.size or 1.0)

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """In cvxpy."""
        import cvxpy as cp

        return cp.sum(cp.power(p / self.size, 4))

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """At p."""
        return float(np.sum((p / self.size) ** 4))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """Over twelve decades of the largest curvature."""
        largest = float(np.linalg.norm(WA, 2) ** 2)
        return 1e-6 * largest, 1e6 * largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """All that are not held."""
        return float(len(p) - len(active))


def read_words(path: Path, options: Options) -> Contents:
    """Numbers as `word = 1 2 3`, a line for each channel, under the line "WORDS"."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if lines[-1:] != ["END"]:
        raise RecordingError(f"{path}: it does not end with END. It is cut short: copy it again.")
    rows = [line.partition("=") for line in lines[1:-1]]
    table = np.column_stack([np.array(numbers.split(), dtype=float) for _, _, numbers in rows])
    columns = tuple(name.strip() for name, _, _ in rows)
    return Contents(str(path), "words", {"data": table}, columns, ("",) * len(columns))


WORDS = Format("words", (".words",), lambda head: head.startswith(b"WORDS"), read_words)
