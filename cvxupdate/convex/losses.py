"""Losses: how the weighted residual r = W (A p − b), in standard deviations, is summed. One small
class each.

A loss gives ``data_rows(rows, n)``, the rows of its program's data; ``reduce(WA, Wb)``, the data
(R, d, constant) with loss(W(Ap − b)) = loss(R p − d) + constant; ``expression(r)`` for cvxpy and
``value(r)`` for numpy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..errors import InputError
from ..system import Array


@dataclass(frozen=True)
class LeastSquares:
    """‖W (A p − b)‖². Tall systems are reduced by QR to n rows; what p cannot reach stays as a
    constant."""

    name: ClassVar[str] = "least-squares"

    def data_rows(self, rows: int, n: int) -> int:
        """min(rows, n): the program does not grow with the number of rows."""
        return min(rows, n)

    def reduce(self, WA: Array, Wb: Array) -> tuple[Array, Array, float]:
        """R (min(m, n), n), d and the constant of one QR factorisation of [WA Wb] (Golub & Van Loan
        5.3)."""
        m, n = WA.shape
        if m <= n:
            return WA, Wb, 0.0
        T: Array = np.asarray(np.linalg.qr(np.column_stack([WA, Wb]), mode="r"))
        constant = float(T[n, n] ** 2) if T.shape[0] > n else 0.0
        return np.ascontiguousarray(T[:n, :n]), np.ascontiguousarray(T[:n, n]), constant

    def expression(self, r: Any) -> Any:
        """The loss as a cvxpy expression."""
        import cvxpy as cp

        return cp.sum_squares(r)

    def value(self, r: Array) -> float:
        """The loss of a residual (m,)."""
        return float(r @ r)


@dataclass(frozen=True)
class AbsoluteLoss:
    """‖W (A p − b)‖₁: outliers pull no harder than small residuals."""

    name: ClassVar[str] = "l1"

    def data_rows(self, rows: int, n: int) -> int:
        """All rows: an absolute sum cannot be reduced."""
        return rows

    def reduce(self, WA: Array, Wb: Array) -> tuple[Array, Array, float]:
        """The data as they are."""
        return WA, Wb, 0.0

    def expression(self, r: Any) -> Any:
        """The loss as a cvxpy expression."""
        import cvxpy as cp

        return cp.norm1(r)

    def value(self, r: Array) -> float:
        """The loss of a residual (m,)."""
        return float(np.abs(r).sum())


@dataclass(frozen=True)
class Norm:
    """‖W (A p − b)‖, not squared: what worst-case least squares needs beside the regulariser
    `Robust`."""

    name: ClassVar[str] = "norm"

    def data_rows(self, rows: int, n: int) -> int:
        """min(rows, n + 1): the last keeps what p cannot reach, which a norm may not leave out."""
        return min(rows, n + 1)

    def reduce(self, WA: Array, Wb: Array) -> tuple[Array, Array, float]:
        """The triangle of [WA Wb]: the norm of its residual is that of all rows."""
        m, n = WA.shape
        if m <= n + 1:
            return WA, Wb, 0.0
        T: Array = np.asarray(np.linalg.qr(np.column_stack([WA, Wb]), mode="r"))
        return np.ascontiguousarray(T[:, :n]), np.ascontiguousarray(T[:, n]), 0.0

    def expression(self, r: Any) -> Any:
        """The loss as a cvxpy expression."""
        import cvxpy as cp

        return cp.norm(r, 2)

    def value(self, r: Array) -> float:
        """The loss of a residual (m,)."""
        return float(np.linalg.norm(r))


@dataclass(frozen=True)
class Huber:
    """Σ r² for |r| ≤ threshold, 2·threshold·|r| − threshold² beyond; in standard deviations (Huber
    1964)."""

    threshold: float = 1.345
    name: ClassVar[str] = "huber"

    def __post_init__(self) -> None:
        if not self.threshold > 0:
            raise InputError(
                f"huber: threshold {self.threshold} must be above 0; 1.345 is customary."
            )

    def data_rows(self, rows: int, n: int) -> int:
        """All rows: the loss of each row counts by itself."""
        return rows

    def reduce(self, WA: Array, Wb: Array) -> tuple[Array, Array, float]:
        """The data as they are."""
        return WA, Wb, 0.0

    def expression(self, r: Any) -> Any:
        """The loss as a cvxpy expression."""
        import cvxpy as cp

        return cp.sum(cp.huber(r, self.threshold))

    def value(self, r: Array) -> float:
        """The loss of a residual (m,)."""
        a, t = np.abs(r), self.threshold
        return float(np.where(a <= t, a**2, 2 * t * a - t**2).sum())


Loss = LeastSquares | AbsoluteLoss | Huber | Norm
LOSSES: tuple[type[Loss], ...] = (LeastSquares, AbsoluteLoss, Huber, Norm)


def loss_named(name: str, threshold: float = 1.345) -> Loss:
    """The loss of a problem file's name: "least-squares", "l1", "huber" or "norm"."""
    if name == Huber.name:
        return Huber(threshold)
    for kind in (LeastSquares, AbsoluteLoss, Norm):
        if kind.name == name:
            return kind()
    raise InputError(
        f"loss {name!r} is not known; choose one of "
        + ", ".join(repr(kind.name) for kind in LOSSES)
        + "."
    )
