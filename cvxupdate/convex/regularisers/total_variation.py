"""Total variation between neighbouring elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...system import Array
from ..constraints.clauses import positions
from ..context import Context
from .common import check_weight, null_space


@dataclass(frozen=True, eq=False)
class TotalVariation:
    """weight · Σ |p_i − p_j| over neighbouring pairs: the change is constant over patches with few
    edges (Rudin, Osher & Fatemi 1992).

    ``pairs`` of parameter names; ``weight`` a number or a rule.
    """

    weight: float | str
    pairs: tuple[tuple[str, str], ...]
    name: ClassVar[str] = "total-variation"
    keys: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> TotalVariation:
        """Over all parameters that are coupled."""
        return cls(table.weight, context.coupled())

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)
        if not self.pairs:
            raise InputError(
                "total-variation: no two parameters are neighbours. Free a property of "
                'single elements that touch (each = "element").'
            )

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        return cp.norm1(self.differences(columns) @ p)

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight."""
        return float(np.abs(self.differences(columns) @ p).sum())

    def differences(self, columns: tuple[str, ...]) -> Array:
        """The matrix (pairs, n) of p_i − p_j."""
        out = np.zeros((len(self.pairs), len(columns)))
        for row, pair in enumerate(self.pairs):
            i, j = positions(pair, columns, self.name)
            out[row, i], out[row, j] = 1.0, -1.0
        return out

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """Up to a weight at which every patch is one: the gradient at the best constant, carried by
        the differences (least squares)."""
        D = self.differences(columns)
        flat = null_space(D, len(columns))
        constant = flat @ np.linalg.lstsq(WA @ flat, Wb, rcond=None)[0]
        gradient = 2 * WA.T @ (Wb - WA @ constant)
        flow = np.linalg.lstsq(D.T, gradient, rcond=None)[0]
        largest = max(float(np.max(np.abs(flow))), np.finfo(float).tiny * 1e8)
        return 1e-6 * largest, largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Number of patches (Tibshirani & Taylor 2011), less the active constraints."""
        D = self.differences(columns)
        jumps = np.abs(D @ p)
        held = D[jumps <= 1e-6 * max(float(jumps.max(initial=0.0)), 1e-12)]
        rows = np.vstack([held, active]) if active.shape[0] else held
        return float(null_space(rows, len(columns)).shape[1])
