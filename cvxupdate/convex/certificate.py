"""What a solution proves, recomputed from the returned primal and dual by numpy alone; a solver's
own figures are not used.

All figures are relative:

=================  ==========================================================================
primal             ‖A x + s − b‖∞ / max(1, ‖A x‖∞, ‖s‖∞, ‖b‖∞)
dual               ‖P x + q + Aᵀ z‖∞ / max(1, ‖P x‖∞, ‖q‖∞, ‖Aᵀ z‖∞)      (stationarity)
gap                |xᵀ P x + qᵀ x + bᵀ z| / max(1, |primal value|, |dual value|)
complementarity    |sᵀ z| / max(1, |primal value|, |dual value|)
primal_cone        distance of s from K / max(1, ‖A x‖∞, ‖s‖∞, ‖b‖∞)
dual_cone          distance of z from K* / max(1, ‖P x‖∞, ‖q‖∞, ‖Aᵀ z‖∞)
=================  ==========================================================================

The 1 is natural: weighted residuals count standard deviations.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from ..system import Array
from .cones import dual_violation, primal_violation
from .matrix_form import ConeProgram


def _size(v: Array) -> float:
    return float(np.max(np.abs(v))) if v.size else 0.0


@dataclass(frozen=True)
class Certificate:
    """Relative residuals of the optimality conditions, scaled as the module says; NaN where there
    is no point."""

    primal: float
    dual: float
    gap: float
    complementarity: float
    primal_cone: float
    dual_cone: float

    @property
    def worst(self) -> float:
        """The largest of the six residuals; infinite when one is not a number."""
        values = (
            self.primal,
            self.dual,
            self.gap,
            self.complementarity,
            self.primal_cone,
            self.dual_cone,
        )
        return max(values) if all(map(math.isfinite, values)) else math.inf

    def is_optimal(self, tolerance: float = 1e-6) -> bool:
        """Whether every residual is at most ``tolerance``: the point is then optimal to that
        relative accuracy."""
        return self.worst <= tolerance

    def as_dict(self) -> dict[str, float | None]:
        """The residuals by name, None where there is none (JSON has no NaN)."""
        return {key: value if math.isfinite(value) else None for key, value in asdict(self).items()}


NO_CERTIFICATE = Certificate(*(math.nan,) * 6)


def certify(program: ConeProgram, x: Array, s: Array, z: Array) -> Certificate:
    """Recompute the optimality conditions of ``program`` at (x, s, z).

    Parameters
    ----------
    x : (variables,) primal; s : (rows,) slack; z : (rows,) dual.
    """
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(s)) and np.all(np.isfinite(z))):
        return NO_CERTIFICATE
    Ax, Px, Atz = program.A @ x, program.P @ x, program.A.T @ z
    primal_scale = max(1.0, _size(Ax), _size(s), _size(program.b))
    dual_scale = max(1.0, _size(Px), _size(program.q), _size(Atz))
    primal_value = float(0.5 * x @ Px + program.q @ x)
    dual_value = float(-0.5 * x @ Px - program.b @ z)
    value_scale = max(1.0, abs(primal_value), abs(dual_value))
    return Certificate(
        primal=_size(Ax + s - program.b) / primal_scale,
        dual=_size(Px + program.q + Atz) / dual_scale,
        gap=abs(primal_value - dual_value) / value_scale,
        complementarity=float(abs(s @ z)) / value_scale,
        primal_cone=primal_violation(s, program.cones) / primal_scale,
        dual_cone=dual_violation(z, program.cones) / dual_scale,
    )


@dataclass(frozen=True)
class Farkas:
    """Proof that A x + s = b, s in K has no solution: z in K* with Aᵀ z = 0 and bᵀ z < 0 (Boyd &
    Vandenberghe 5.8).

    With z scaled so that ‖z‖∞ = 1: ``stationarity`` is ‖Aᵀ z‖∞ / max(1, ‖A‖∞), ``dual_cone`` the
    distance of z from K*, and ``separation`` is −bᵀ z / max(1, ‖b‖∞), which must be positive and
    well above the other two.
    """

    stationarity: float
    dual_cone: float
    separation: float

    def proves(self, tolerance: float = 1e-6) -> bool:
        """Whether the residuals are within ``tolerance`` and ten times smaller than the
        separation."""
        error = max(self.stationarity, self.dual_cone)
        return math.isfinite(error) and error <= tolerance and self.separation > 10 * error


def farkas(program: ConeProgram, z: Array) -> Farkas:
    """Check a multiplier z (rows,) as a proof that the constraints of ``program`` cannot hold
    together."""
    size = _size(z)
    if not np.all(np.isfinite(z)) or size == 0.0:
        return Farkas(math.inf, math.inf, -math.inf)
    y = z / size
    row_sums = np.abs(program.A).sum(axis=0)
    return Farkas(
        stationarity=_size(program.A.T @ y) / max(1.0, _size(np.asarray(row_sums))),
        dual_cone=dual_violation(y, program.cones),
        separation=-float(program.b @ y) / max(1.0, _size(program.b)),
    )
