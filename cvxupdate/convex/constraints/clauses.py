"""Named clauses: what a constraint asks, in words and in rows.

A constraint is a frozen dataclass with ``clauses(columns) -> tuple[Clause, ...]``. One that has
keys of [constraints] also has ``from_spec(table, context)``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp

from ...errors import InputError
from ...system import Array
from ..context import Key

ACTIVE = 1e-6
"""Of a limit: what is nearer to it than this part of it lies on it."""


@dataclass(frozen=True, eq=False)
class LinearClause:
    """lower ≤ C p[on] ≤ upper.

    ``on`` numbers the k parameters that it touches; ``C`` is (rows, k); ``lower`` and ``upper``
    (rows,), ±inf where open, equal for an equality; ``unit`` is the unit of the limits, for words.
    """

    name: str
    on: tuple[int, ...]
    C: Array
    lower: Array
    upper: Array
    unit: str = ""

    def __post_init__(self) -> None:
        if (
            not np.all(np.isfinite(self.C))
            or np.any(np.isnan(self.lower))
            or np.any(np.isnan(self.upper))
        ):
            raise InputError(f"{self.name}: has values that are not finite numbers.")
        if np.any(self.lower > self.upper):
            raise InputError(
                f"{self.name}: the lower limit lies above the upper one; exchange them."
            )


@dataclass(frozen=True, eq=False)
class Semidefinite:
    """One matrix of order k that is affine in the parameters and stays positive semidefinite.

    Its upper triangle by columns, off-diagonals times √2, is F p[on] + f: ``F`` scipy CSR
    (k(k+1)/2, entries of ``on``), ``f`` (k(k+1)/2,).
    """

    on: tuple[int, ...]
    F: Any
    f: Array
    order: int


@dataclass(frozen=True, eq=False)
class ConicClause:
    """A convex clause that is not linear: second-order cone, matrix inequality, exponential cone.

    ``constraints(p, slack)`` gives the cvxpy constraints with the clause relaxed by ``slack`` ≥ 0
    (a cvxpy variable, or 0.0 for the clause itself); ``margin(p)`` is a numpy function, at least 0
    where the clause holds, in ``unit``. ``matrix`` says the clause itself without cvxpy where it is
    one small semidefinite matrix: a thousand of them are written down faster than compiled.
    """

    name: str
    constraints: Callable[[Any, Any], Sequence[Any]]
    margin: Callable[[Array], float]
    unit: str = ""
    matrix: Semidefinite | None = None


Clause = LinearClause | ConicClause


class Constraint(Protocol):
    """What every constraint offers."""

    @property
    def keys(self) -> Mapping[str, Key]:
        """Its keys of [constraints]; none where other constraints are made of it.

        A class with keys has a class method ``from_spec(table, context)``, which makes the
        constraint of one table, or None where the table is another constraint's.
        """

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """The named clauses for parameters of these names."""
        ...


@dataclass(frozen=True, eq=False)
class LinearRows:
    """The rows of many linear clauses, stacked: lower ≤ C p ≤ upper; ``owner`` numbers the clause
    of each row."""

    C: Any
    lower: Array
    upper: Array
    owner: Any

    @property
    def equal(self) -> Any:
        """(rows,) True where the row is an equality."""
        return self.lower == self.upper


def stack(clauses: Sequence[LinearClause], n: int) -> LinearRows:
    """Stack linear clauses over n parameters; ``C`` becomes a scipy CSR array."""
    rows, cols, values, lower, upper, owner = [], [], [], [], [], []
    at = 0
    for number, clause in enumerate(clauses):
        k, width = clause.C.shape
        rows.append(np.repeat(np.arange(at, at + k), width))
        cols.append(np.tile(np.asarray(clause.on, dtype=int), k))
        values.append(clause.C.ravel())
        lower.append(clause.lower)
        upper.append(clause.upper)
        owner.append(np.full(k, number))
        at += k
    if not clauses:
        return LinearRows(sp.csr_array((0, n)), np.zeros(0), np.zeros(0), np.zeros(0, dtype=int))
    C = sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(at, n)
    )
    C.eliminate_zeros()
    return LinearRows(C, np.concatenate(lower), np.concatenate(upper), np.concatenate(owner))


def positions(names: Sequence[str], columns: tuple[str, ...], what: str) -> tuple[int, ...]:
    """Where the named parameters stand; InputError names those that are unknown."""
    where = {name: i for i, name in enumerate(columns)}
    unknown = [name for name in names if name not in where]
    if unknown:
        raise InputError(
            f"{what}: no parameter is called {', '.join(unknown)}; the parameters are "
            f"{shortened(columns)}."
        )
    return tuple(where[name] for name in names)


def shortened(names: Sequence[str], limit: int = 8) -> str:
    """A list of names in words, cut after ``limit``."""
    shown = ", ".join(names[:limit])
    return shown if len(names) <= limit else f"{shown} and {len(names) - limit} more"


def violation(clause: Clause, p: Array) -> float:
    """By how much p (n,) breaks the clause, in the clause's unit; 0 when it holds."""
    if isinstance(clause, ConicClause):
        return max(0.0, -clause.margin(p))
    value = clause.C @ p[list(clause.on)]
    return float(max(0.0, np.max(clause.lower - value), np.max(value - clause.upper)))


def is_active(clause: Clause, p: Array, tolerance: float = ACTIVE) -> bool:
    """Whether an inequality of the clause holds with equality at p, or the clause is an equality.

    ``tolerance`` is relative to the limit (and to 1e-3 of the parameter's unit for limits near 0).
    """
    if isinstance(clause, ConicClause):
        return clause.margin(p) <= tolerance
    value = clause.C @ p[list(clause.on)]
    if len(value) == 1:  # bounds and trust regions, by far the most: numpy costs more than they do
        v, limits = float(value[0]), (float(clause.lower[0]), float(clause.upper[0]))
        return any(
            math.isfinite(limit) and abs(v - limit) <= tolerance * max(1e-3, abs(limit))
            for limit in limits
        )
    for limit in (clause.lower, clause.upper):
        finite = np.isfinite(limit)
        near = np.abs(value - np.where(finite, limit, 0.0)) <= tolerance * np.maximum(
            1e-3, np.abs(np.where(finite, limit, 1.0))
        )
        if np.any(finite & near):
            return True
    return False
