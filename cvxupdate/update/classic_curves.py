"""What the penalised solutions of chapter 4 are chosen by: the L-curve in closed form, and maximum
entropy by Newton's method. Pure functions of arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cvxupdate.convex.weight import curvature
from cvxupdate.errors import InputError
from cvxupdate.system import Array

POINTS = 61
"""Weights on an L-curve, evenly on a logarithmic scale."""
EXACT = 1e-22
"""Decrease, of the value, that a further step of Newton's method may promise at the end."""
ROUNDING = 1e-10
"""Promised decrease, of the value, below which the value is too rounded to judge a step."""
SHORTEST = 1e-12
NEWTON = 60
"""Steps of Newton's method at most; the penalty is self-concordant enough for a dozen."""
INSIDE = 0.9
"""Of the way of a factor to zero: no step of Newton's method takes it farther."""
LEAST = 1e-12
"""A factor that small is zero to rounding, and stays there while it is drawn below."""


@dataclass(frozen=True)
class Curve:
    """An L-curve (Hansen & O'Leary 1993): ``alpha`` rising, the residuals ‖A p − b‖, ``size`` ‖p‖,
    and the place of the ``corner``."""

    alpha: Array
    residual: Array
    size: Array
    corner: int


def l_curve(A: Array, b: Array, solve: Callable[[float], Array]) -> Curve:
    """The L-curve of ``solve(alpha)`` between the squares of the extreme singular values, and its
    point of largest curvature (4.3); where it has no corner, the least weight."""
    s = np.linalg.svd(A, compute_uv=False)
    top = max(float(s[0]), np.finfo(float).tiny) ** 2
    alpha = np.geomspace(max(float(s[-1]) ** 2, 1e-12 * top), top, POINTS)
    found = [solve(float(a)) for a in alpha]
    residual = np.array([np.linalg.norm(A @ p - b) for p in found])
    size = np.array([np.linalg.norm(p) for p in found])
    usable = (residual > 0.0) & (size > 0.0)
    score = np.full(POINTS, -np.inf)
    if usable.sum() >= 5:
        x, y = np.log(residual[usable]), np.log(size[usable])
        length = float(np.sum(np.hypot(np.diff(x), np.diff(y))))
        score[usable] = np.nan_to_num(curvature(x, y, length / 20), nan=-np.inf)
    corner = int(np.argmax(score)) if np.max(score) > 0.0 else 0
    return Curve(alpha, residual, size, corner)


def entropy_of(p: Array) -> float:
    """Twice Σ q ln q − q + 1 with q = 1 + p, which near the model as it stands is ‖p‖² (4.23,
    relative to q = 1); infinite where a factor is not above 0."""
    q = 1.0 + p
    return float(2.0 * np.sum(q * np.log(q) - q + 1.0)) if np.all(q > 0.0) else float("inf")


def entropy(A: Array, b: Array, alpha: float) -> Array:
    """min ‖A p − b‖² + 2 α Σ (q ln q − q + 1), q = 1 + p > 0 (4.22–4.23): the maximum entropy
    solution with its multiplier α, by Newton's method with backtracking from p = 0.

    Near p = 0 the penalty is α ‖p‖², so that α is Tikhonov's.

    Raises
    ------
    InputError
        When α is not above 0.
    """
    if not alpha > 0.0:
        raise InputError(f"maximum entropy: alpha {alpha:g} must be above 0.")
    p = np.zeros(A.shape[1])

    def value(at: Array) -> float:
        return float(np.sum((A @ at - b) ** 2)) + alpha * entropy_of(at)

    now = value(p)
    for _ in range(NEWTON):
        # As least squares of stacked rows: the normal equations would lose half the digits.
        q = 1.0 + p
        slope = A.T @ (A @ p - b) + alpha * np.log(q)
        free = (q > 2.0 * LEAST) | (slope < 0.0)
        root = np.sqrt(alpha / q)
        right = np.concatenate([b - A @ p, -alpha * np.log(q) / root])
        stacked = np.vstack([A, np.diag(root)])[:, free]
        step = np.zeros(len(p))
        step[free] = np.linalg.lstsq(stacked, right, rcond=None)[0]
        falls = float(np.sum((stacked @ step[free]) ** 2))
        if falls <= EXACT * now:
            break
        least = np.maximum((1.0 - INSIDE) * q, LEAST) - 1.0
        length = 1.0
        while (
            falls > ROUNDING * now
            and value(np.maximum(p + length * step, least)) >= now
            and length > SHORTEST
        ):
            length *= 0.5
        p = np.maximum(p + length * step, least)
        now = value(p)
    return p
