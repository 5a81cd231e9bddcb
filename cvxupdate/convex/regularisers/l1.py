"""L1 regularisation: few parameters move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...system import Array
from ..context import Context
from .common import check_weight, free_count, reference_and_scale


@dataclass(frozen=True, eq=False)
class L1:
    """weight · ‖(p − reference)/scale‖₁ (Tibshirani 1996).

    ``reference`` and ``scale``: a number or (n,), in the parameters' units; ``weight`` a number or
    a rule.
    """

    weight: float | str
    reference: Array | float = 0.0
    scale: Array | float = 1.0
    name: ClassVar[str] = "l1"
    keys: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> L1:
        """With the weight of the table."""
        return cls(table.weight)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return cp.norm1(cp.multiply(1 / scale, p - reference))

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight."""
        return float(np.sum(np.abs(self._departure(p, columns))))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """Up to the weight at which no parameter moves (‖2 S AᵀW r‖∞, least squares), from 1e-6 of
        it."""
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        largest = max(
            float(np.max(np.abs(2 * scale * (WA.T @ (Wb - WA @ reference))))),
            np.finfo(float).tiny * 1e8,
        )
        return 1e-6 * largest, largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Number of parameters that moved (Zou, Hastie & Tibshirani 2007), less the active
        constraints among them."""
        departure = np.abs(self._departure(p, columns))
        return free_count(departure > 1e-6 * max(float(departure.max()), 1e-12), active)

    def _departure(self, p: Array, columns: tuple[str, ...]) -> Array:
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return np.asarray((p - reference) / scale)
