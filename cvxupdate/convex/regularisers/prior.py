"""What is known of the parameters before: deviations, or their whole covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import scipy.linalg as la
from pydantic import Field

from cvxupdate.keys import Positive

from ...errors import InputError
from ...system import Array
from ..context import Context
from .common import check_weight, influence_trace

Rows = Annotated[tuple[Annotated[tuple[float, ...], Field(min_length=1)], ...], Field(min_length=1)]
SYMMETRIC = 1e-9  # of the largest entry: digits that a file may have dropped


@dataclass(frozen=True, eq=False)
class Prior:
    """weight · (p − c)ᵀ V⁻¹ (p − c): thesis (2.107), whose V_PP is V⁻¹ here.

    ``covariance`` V (n, n) in the parameters' units, or its diagonal (n,). ``about`` "nominal": c
    = 0, the model as it came, so that the end of a loop is the most probable model (weight 1, rows
    at their deviations; Natke 1988). "present": c is where the step begins, as (2.107) is printed:
    the steps are held back and the end of the loop is not; the penalty is of the move p − c.
    ``weight``: 1 is Bayes'.
    """

    weight: float | str
    covariance: Array
    about: str = "nominal"
    name: ClassVar[str] = "prior"
    keys: ClassVar[Mapping[str, Any]] = {
        "about": (
            Literal["nominal", "present"],
            Field(
                default="nominal",
                description="prior: about the model as it came, or about the point where each "
                "step begins (holds the steps back, not the end)",
            ),
        ),
        "deviation": (
            Positive | None,
            Field(
                default=None,
                description="prior: standard deviation of every p that `deviations` does not name",
            ),
        ),
        "deviations": (
            dict[str, Positive],
            Field(
                default={},
                description="prior: standard deviations of p by the name of the parameter",
            ),
        ),
        "covariance": (
            Rows | None,
            Field(
                default=None,
                description="prior: the covariance of p, row by row in the order of the parameters",
            ),
        ),
    }

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> Prior:
        """With the deviations or the covariance of the table; its weight is 1 where it has none."""
        weight = table.weight if "weight" in table.model_fields_set else 1.0
        return cls(weight, _covariance(table, context.columns), table.about)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)
        if self.of_move and isinstance(self.weight, str):
            raise InputError(
                "prior: a weight by a rule needs one centre for all steps. Give a number, or "
                'about = "nominal".'
            )
        V = np.asarray(self.covariance, dtype=float)
        if V.ndim == 1:
            if not (np.all(np.isfinite(V)) and np.all(V > 0.0)):
                raise InputError("prior: every variance must be a finite number above 0.")
            return
        square = V.ndim == 2 and V.shape[0] == V.shape[1] and bool(np.all(np.isfinite(V)))
        if not square or np.abs(V - V.T).max() > SYMMETRIC * np.abs(V).max():
            raise InputError("prior: the covariance must be a symmetric matrix of finite numbers.")
        scale = np.sqrt(np.maximum(np.diag(V), np.finfo(float).tiny))
        if la.eigvalsh((V + V.T) / 2.0 / np.outer(scale, scale))[0] <= 1e-12:
            raise InputError(
                "prior: the covariance must be positive definite: some combination of parameters "
                "would have no deviation. Tie such parameters in [constraints] instead."
            )

    @property
    def of_move(self) -> bool:
        """Whether the penalty is of the move from where the step begins."""
        return self.about == "present"

    @property
    def matrix(self) -> Array:
        """V (n, n)."""
        return np.diag(self.covariance) if self.covariance.ndim == 1 else self.covariance

    @cached_property
    def deviations(self) -> Array | None:
        """(n,) where the parameters are independent and only these were given, else None."""
        return np.sqrt(self.covariance) if self.covariance.ndim == 1 else None

    @cached_property
    def root(self) -> Array:
        """F (n, n) with FᵀF = V⁻¹: F p counts deviations."""
        if self.deviations is not None:
            return np.diag(1.0 / self.deviations)
        V = (self.covariance + self.covariance.T) / 2.0
        size = np.sqrt(np.diag(V))  # unlike units would cost digits
        L = la.cholesky(V / np.outer(size, size), lower=True)
        return np.asarray(la.solve_triangular(L, np.diag(1.0 / size), lower=True))

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty of p, or of a move p, in cvxpy, without the weight."""
        import cvxpy as cp

        self._check(len(columns))
        if self.deviations is not None:
            return cp.sum_squares(cp.multiply(1.0 / self.deviations, p))
        return cp.sum_squares(self.root @ p)

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty of p (n,), or of a move, without the weight."""
        self._check(len(columns))
        counted = self.root @ p if self.deviations is None else p / self.deviations
        return float(np.sum(counted**2))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """From below the smallest squared singular value of WA F⁻¹ to ten times the largest."""
        singular = la.svdvals(self._whitened(WA, len(columns))) ** 2
        largest = max(float(singular[0]), np.finfo(float).tiny)
        return 0.01 * max(float(singular[-1]), 1e-12 * largest), 10 * largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Trace of the influence matrix within the active constraints."""
        self._check(len(columns))
        return influence_trace(WA, self.root, weight, active)

    def _whitened(self, WA: Array, n: int) -> Array:
        self._check(n)
        return np.asarray(la.solve_triangular(self.root.T, WA.T, lower=False).T)

    def _check(self, n: int) -> None:
        k = len(self.covariance)
        if k != n:
            raise InputError(f"prior: the covariance is {k} × {k}, but there are {n} parameters.")


def _covariance(table: Any, columns: tuple[str, ...]) -> Array:
    """The covariance (n, n) that a table states, or the variances (n,).

    Raises
    ------
    InputError
        Where it states none, two, or one of other parameters.
    """
    if table.covariance is not None:
        if table.deviation is not None or table.deviations:
            raise InputError(
                "regularisation: a prior has `covariance`, or `deviation` and `deviations`, not "
                "both."
            )
        if any(len(row) != len(columns) for row in (table.covariance, *table.covariance)):
            raise InputError(
                f"regularisation: the prior's covariance must have {len(columns)} rows of "
                f"{len(columns)} numbers, one for each parameter ({', '.join(columns[:4])} …)."
            )
        return np.array(table.covariance)
    unknown = [name for name in table.deviations if name not in columns]
    if unknown:
        raise InputError(
            f"regularisation: the prior states a deviation of {', '.join(unknown)}, which is no "
            f"parameter; they are {', '.join(columns[:8])}."
        )
    open_ = [name for name in columns if name not in table.deviations]
    if open_ and table.deviation is None:
        raise InputError(
            f"regularisation: the prior states no deviation of {', '.join(open_[:5])}. Add "
            "`deviation` for all that `deviations` does not name."
        )
    std = np.array([table.deviations.get(name, table.deviation) for name in columns], dtype=float)
    return np.asarray(std**2)
