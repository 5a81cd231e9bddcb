"""The linear residual system ``A p ≈ b``: what recordings and model give to a convex step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearSystem:
    """Rows of measured-against-model differences, linear in the parameters.

    Parameters
    ----------
    A : (m, n) real array, the derivative of every row with respect to every parameter.
    b : (m,) real array, in the unit of the row; ``A @ p - b`` is the residual at the absolute
    parameter values ``p``.
    weights : (m,) real array, one over the standard deviation of each row; ``weights * (A @ p -
    b)`` is dimensionless.
    columns : n parameter names, e.g. ``"e12.stiffness"`` or ``"plate.E"``.
    rows : m row labels, e.g. ``"mode 3 frequency"``.
    equations : number of independent differences, where rows were combined orthogonally to fewer
    (None: m).

    Raises
    ------
    ValueError
        When the shapes do not agree or a value is not finite.
    """

    A: Array
    b: Array
    weights: Array
    columns: tuple[str, ...]
    rows: tuple[str, ...]
    equations: int | None = None

    @property
    def count(self) -> int:
        """Number of independent differences that the rows stand for."""
        return len(self.rows) if self.equations is None else self.equations

    def __post_init__(self) -> None:
        m, n = self.A.shape
        if (
            self.b.shape != (m,)
            or self.weights.shape != (m,)
            or len(self.rows) != m
            or len(self.columns) != n
        ):
            raise ValueError(
                f"LinearSystem: A is {m} x {n}, but b {self.b.shape}, weights "
                f"{self.weights.shape}, {len(self.rows)} row labels and {len(self.columns)} "
                "column names were given"
            )
        for name, value in (("A", self.A), ("b", self.b), ("weights", self.weights)):
            if not np.all(np.isfinite(value)):
                raise ValueError(f"LinearSystem: {name} has entries that are not finite")

    def weighted(self) -> tuple[Array, Array]:
        """The weighted system (W A, W b), both dimensionless."""
        return self.weights[:, None] * self.A, self.weights * self.b

    def residual(self, p: Array) -> Array:
        """Weighted residual W (A p - b), shape (m,)."""
        return np.asarray(self.weights * (self.A @ p - self.b))
