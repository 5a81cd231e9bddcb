"""Maximum entropy regularisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...system import Array
from ..context import Context
from .common import check_weight, influence_trace, reference_and_scale


@dataclass(frozen=True, eq=False)
class Entropy:
    """weight · Σ q ln(q/q₀) − q + q₀ with the factors q = 1 + p and q₀ = 1 + reference (thesis
    4.23; an exponential cone).

    The thesis's Σ q ln q draws every factor to 1/e; relative to the model as it stands
    (Kullback–Leibler; Csiszár 1991) it draws p to the reference. It keeps every factor above 0.
    ``reference``: a number or (n,), above −1; ``weight`` a number or a rule.
    """

    weight: float | str
    reference: Array | float = 0.0
    name: ClassVar[str] = "entropy"
    keys: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> Entropy:
        """With the weight of the table."""
        return cls(table.weight)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)
        if np.any(np.asarray(self.reference) <= -1.0):
            raise InputError(
                "entropy: the reference must lie above −1, so that the factors 1 + p have a "
                "logarithm."
            )

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        reference, _ = reference_and_scale(self.name, self.reference, 1.0, len(columns))
        return cp.sum(cp.kl_div(1.0 + p, 1.0 + reference))

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight; inf where a factor is below 0."""
        reference, _ = reference_and_scale(self.name, self.reference, 1.0, len(columns))
        q, q0 = 1.0 + p, 1.0 + reference
        if np.any(q < 0.0):
            return float("inf")
        return float(
            np.sum(np.where(q > 0.0, q * np.log(np.where(q > 0.0, q, 1.0) / q0), 0.0) - q + q0)
        )

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """As for Tikhonov: near the reference the penalty is Σ (p − reference)²/2q₀."""
        reference, _ = reference_and_scale(self.name, self.reference, 1.0, len(columns))
        singular = np.linalg.svd(WA * np.sqrt(1.0 + reference), compute_uv=False) ** 2
        largest = max(float(singular[0]), np.finfo(float).tiny)
        return 0.02 * max(float(singular[-1]), 1e-12 * largest), 20 * largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Trace of the influence matrix with the penalty's curvature 1/2q at p."""
        root = np.diag(1.0 / np.sqrt(2.0 * np.maximum(1.0 + p, 1e-9)))
        return influence_trace(WA, root, weight, active)
