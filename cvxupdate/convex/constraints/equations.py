"""Equations that hold exactly, or within their deviations: a mode reproduced, rigid-body modes
kept, inertia conserved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...system import Array
from ..context import Key
from .clauses import Clause, LinearClause
from .norm_at_most import NormAtMost

RANK = 1e-11  # of the largest singular value: below it a row says nothing


@dataclass(frozen=True, eq=False)
class Equations:
    """A p = b as one named clause, or ‖A p − b‖ ≤ within.

    Parameters
    ----------
    A : (rows, n); b : (rows,); label : the clause in words; within : None for exact, else a bound
    in the unit of b.
    noise : rounding of b relative to the largest entry of A and b, below which an equation that no
    parameter can change counts as met.
    """

    A: Array
    b: Array
    label: str
    within: float | None = None
    unit: str = ""
    noise: float = 1e-9
    keys: ClassVar[Mapping[str, Key]] = {}

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause. Equations that depend on one another are reduced to independent ones; those
        that contradict one another stay, so that the conflict is named. No clause when the
        equations hold whatever the parameters."""
        A, b = np.asarray(self.A, dtype=float), np.asarray(self.b, dtype=float)
        if (
            A.ndim != 2
            or A.shape[1] != len(columns)
            or b.shape != A.shape[:1]
            or not (np.all(np.isfinite(A)) and np.all(np.isfinite(b)))
        ):
            raise InputError(
                f"{self.label}: A is {A.shape} and b {b.shape}, but there are {len(columns)} "
                "parameters (all values finite)."
            )
        if self.within is not None:
            return NormAtMost(A, b, self.within, self.label, self.unit).clauses(columns)
        size = max(float(np.abs(A).max(initial=0.0)), float(np.abs(b).max(initial=0.0)))
        if size == 0.0:
            return ()
        U, s, Vt = np.linalg.svd(A, full_matrices=False)
        keep = s > RANK * s.max(initial=0.0)
        rows, right = s[keep, None] * Vt[keep], U[:, keep].T @ b
        rest = b - U[:, keep] @ right
        if float(np.abs(rest).max(initial=0.0)) > self.noise * size:
            rows, right = (
                np.vstack([rows, np.zeros(len(columns))]),
                np.append(right, float(np.linalg.norm(rest))),
            )
        rows = np.where(np.abs(rows) > 1e-14 * np.abs(rows).max(initial=0.0), rows, 0.0)
        on = np.flatnonzero(np.abs(rows).sum(axis=0) > 0.0)
        if not len(rows):
            return ()
        if not on.size:
            on = np.zeros(1, dtype=int)
        return (
            LinearClause(self.label, tuple(map(int, on)), rows[:, on], right, right, self.unit),
        )
