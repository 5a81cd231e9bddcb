"""The price of an uncertain A: with the loss "norm" this is worst-case least squares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...system import Array
from ..context import Context
from .common import check_weight, reference_and_scale


@dataclass(frozen=True, eq=False)
class Robust:
    """weight · √(1 + ‖(p − reference)/scale‖²).

    Beside the loss `Norm` the step minimises max ‖(A + ΔA) p − (b + Δb)‖ over ‖[ΔA Δb]‖_F ≤ weight
    (El Ghaoui & Lebret 1997), a second-order cone program. ``weight``: the size of the error of [A
    b], in the weighted rows' unit, or a rule ("l-curve").
    """

    weight: float | str
    reference: Array | float = 0.0
    scale: Array | float = 1.0
    name: ClassVar[str] = "robust"
    keys: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> Robust:
        """With the weight of the table."""
        return cls(table.weight)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return cp.norm(cp.hstack([cp.multiply(1 / scale, p - reference), np.ones(1)]), 2)

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight."""
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return float(np.sqrt(1.0 + np.sum(((p - reference) / scale) ** 2)))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """From hardly any to ‖A‖: an error as large as A itself leaves nothing to fit."""
        _, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        largest = max(float(np.linalg.norm(WA * scale)), np.finfo(float).tiny)
        return 1e-6 * largest, largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Of the ridge that has the same solution, α = weight ‖r‖ / √(1 + ‖p‖²), with ‖r‖ taken as
        √m (rows at their deviations)."""
        from .tikhonov import Tikhonov

        alpha = weight * np.sqrt(WA.shape[0]) / self.value(p, columns)
        return Tikhonov(0.0, self.reference, self.scale).degrees_of_freedom(
            WA, p, alpha, active, columns
        )
