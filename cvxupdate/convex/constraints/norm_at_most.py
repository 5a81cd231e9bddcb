"""A second-order cone: a norm of an affine function of the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...system import Array
from ..context import Key
from .clauses import Clause, ConicClause


@dataclass(frozen=True, eq=False)
class NormAtMost:
    """‖F p − g‖₂ ≤ radius: a budget on the change (F = I), or residuals held within their
    deviations.

    Parameters
    ----------
    F : (k, n); g : (k,); radius : in the unit of F p; label : the clause in words.
    """

    F: Array
    g: Array
    radius: float
    label: str
    unit: str = ""
    keys: ClassVar[Mapping[str, Key]] = {}

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One second-order cone clause."""
        F, g = np.asarray(self.F, dtype=float), np.asarray(self.g, dtype=float)
        if F.ndim != 2 or F.shape[1] != len(columns) or g.shape != F.shape[:1]:
            raise InputError(
                f"{self.label}: F is {F.shape} and g {g.shape}, but there are {len(columns)} "
                "parameters."
            )
        if not self.radius >= 0:
            raise InputError(f"{self.label}: the radius {self.radius} must not be negative.")

        def constraints(p: Any, slack: Any) -> Sequence[Any]:
            import cvxpy as cp

            return [cp.norm(F @ p - g, 2) <= self.radius + slack]

        return (
            ConicClause(
                self.label,
                constraints,
                lambda p: self.radius - float(np.linalg.norm(F @ p - g)),
                self.unit,
            ),
        )
