"""Tikhonov regularisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...system import Array
from ..context import Context
from .common import check_weight, null_space, reference_and_scale


@dataclass(frozen=True, eq=False)
class Tikhonov:
    """weight · ‖(p − reference)/scale‖² (thesis 4.7, where α = weight; Tikhonov 1963).

    ``reference`` and ``scale``: a number or (n,), in the parameters' units; ``weight`` a number or
    a rule.
    """

    weight: float | str
    reference: Array | float = 0.0
    scale: Array | float = 1.0
    name: ClassVar[str] = "tikhonov"
    keys: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> Tikhonov:
        """With the weight of the table."""
        return cls(table.weight)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return cp.sum_squares(cp.multiply(1 / scale, p - reference))

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight."""
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        return float(np.sum(((p - reference) / scale) ** 2))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """From below the smallest squared singular value of WA·scale to ten times the largest."""
        _, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        singular = np.linalg.svd(WA * scale, compute_uv=False) ** 2
        largest = max(float(singular[0]), np.finfo(float).tiny)
        return 0.01 * max(float(singular[-1]), 1e-12 * largest), 10 * largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Trace of the influence matrix within the active constraints (Golub, Heath & Wahba
        1979)."""
        _, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        Z = null_space(active, WA.shape[1])
        if Z.shape[1] == 0:
            return 0.0
        T: Array = np.asarray(np.linalg.qr(Z / scale[:, None], mode="r"))
        singular = np.linalg.svd(np.linalg.solve(T.T, (WA @ Z).T), compute_uv=False) ** 2
        kept = singular[singular > 1e-15 * singular[0]] if singular[0] > 0 else singular[:0]
        return float(np.sum(kept / (kept + weight)))
