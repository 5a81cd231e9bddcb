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

    ``covariance`` V (n, n) in the parameters' units. ``about`` "nominal": c = 0, the model as it
    came, so that the end of a loop is the most probable model (weight 1, rows at their deviations;
    Natke 1988). "present": c is where the step begins, as (2.107) is printed: the steps are held
    back and the end of the loop is not; the penalty is of the move p − c. ``weight``: 1 is Bayes'.
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

    @cached_property
    def root(self) -> Array:
        """F (n, n) with FᵀF = V⁻¹: F p counts deviations."""
        V = (self.covariance + self.covariance.T) / 2.0
        size = np.sqrt(np.diag(V))  # unlike units would cost digits
        L = la.cholesky(V / np.outer(size, size), lower=True)
        return np.asarray(la.solve_triangular(L, np.diag(1.0 / size), lower=True))

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty of p, or of a move p, in cvxpy, without the weight."""
        import cvxpy as cp

        return cp.sum_squares(self._root(len(columns)) @ p)

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty of p (n,), or of a move, without the weight."""
        return float(np.sum((self._root(len(columns)) @ p) ** 2))

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """From below the smallest squared singular value of WA F⁻¹ to ten times the largest."""
        singular = la.svdvals(self._whitened(WA, len(columns))) ** 2
        largest = max(float(singular[0]), np.finfo(float).tiny)
        return 0.01 * max(float(singular[-1]), 1e-12 * largest), 10 * largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Trace of the influence matrix within the active constraints."""
        return influence_trace(WA, self._root(len(columns)), weight, active)

    def _whitened(self, WA: Array, n: int) -> Array:
        return np.asarray(la.solve_triangular(self._root(n).T, WA.T, lower=False).T)

    def _root(self, n: int) -> Array:
        if len(self.root) != n:
            raise InputError(
                f"prior: the covariance is {len(self.root)} × {len(self.root)}, but there are {n} "
                "parameters."
            )
        return self.root


def _covariance(table: Any, columns: tuple[str, ...]) -> Array:
    """The covariance (n, n) that a table states.

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
    std = np.array([table.deviations.get(name, table.deviation) for name in columns])
    return np.diag(std**2)
