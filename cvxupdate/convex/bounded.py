"""Least squares within bounds, without a cone program: the step of most fits that `diagnose` makes.

A primal-dual active set (Hintermüller, Ito and Kunisch 2003) on the normal form that
docs/convex-step.md writes down, minimise ½ pᵀH p − gᵀp subject to lower ≤ p ≤ upper: a handful of
small dense solutions. It proves its answer as any solver's is proved; where it does not, a solver
decides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..system import Array
from .certificate import Certificate
from .constraints.clauses import ACTIVE, Clause, LinearClause
from .losses import LeastSquares
from .problem import StepProblem
from .regularisers.common import reference_and_scale
from .regularisers.tikhonov import Tikhonov

PROVED = 1e-9  # residuals of an answer that is taken: what solvers are asked for
MOST = 30  # sets tried: it ends in a handful, or goes round in circles


@dataclass(frozen=True)
class Limits:
    """Bounds (n,) of each parameter, infinite where there are none."""

    lower: Array
    upper: Array

    def within(self, centre: Array, radius: Array) -> Limits:
        """These, and no further than ``radius`` from ``centre``."""
        return Limits(
            np.maximum(self.lower, centre - radius), np.minimum(self.upper, centre + radius)
        )

    def near(self, p: Array) -> Array:
        """Which parameters stand on a limit, as `is_active` says of a clause, (n,)."""
        on = np.zeros(len(p), dtype=bool)
        for limit in (self.lower, self.upper):
            there = np.where(np.isfinite(limit), limit, 0.0)
            tolerance = ACTIVE * np.maximum(1e-3, np.abs(there))
            on |= np.isfinite(limit) & (np.abs(p - there) <= tolerance)
        return on


def limits_of(problem: StepProblem) -> Limits | None:
    """The bounds of a problem of least squares and Tikhonov terms that has no other clauses; None
    of any other."""
    if not isinstance(problem.loss, LeastSquares) or not problem.regularisers:
        return None
    if not all(isinstance(r, Tikhonov) for r in problem.regularisers):
        return None
    n = len(problem.columns)
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for clause in problem.clauses:
        if not isinstance(clause, LinearClause) or clause.C.shape != (1, 1) or clause.C[0, 0] != 1:
            return None
        (i,) = clause.on
        lower[i] = max(lower[i], clause.lower[0])
        upper[i] = min(upper[i], clause.upper[0])
    return Limits(lower, upper)


def active_names(clauses: Sequence[Clause], limits: Limits, p: Array) -> tuple[str, ...]:
    """Names of the clauses of ``limits`` that are active at p (n,)."""
    on = limits.near(p)
    if not np.any(on):
        return ()
    return tuple(c.name for c in clauses if isinstance(c, LinearClause) and on[c.on[0]])


@dataclass(frozen=True)
class Quadratic:
    """‖A p − b‖² + ‖by (p − at)‖²: weighted rows (m, n), (m,), and the Tikhonov terms in one, (n,),
    (n,), with the ``rest`` that no p changes. In the normal form half of that is ½ pᵀH p − gᵀp."""

    A: Array
    b: Array
    by: Array
    at: Array
    rest: float

    def slope(self, p: Array) -> Array:
        """Derivative with respect to p, (n,), from the rows themselves, which loses no digits."""
        left: Array = self.A.T @ (self.A @ p - self.b) + self.by**2 * (p - self.at)
        return 2.0 * left

    def value(self, p: Array) -> float:
        """The objective."""
        terms = np.sum((self.by * (p - self.at)) ** 2)
        return float(np.sum((self.A @ p - self.b) ** 2) + terms) + self.rest

    @property
    def normal(self) -> tuple[Array, Array]:
        """H (n, n) and g (n,): the slope is H p − g."""
        H = 2.0 * (self.A.T @ self.A)
        H[np.diag_indices_from(H)] += 2.0 * self.by**2
        return H, 2.0 * (self.A.T @ self.b + self.by**2 * self.at)


def quadratic_of(problem: StepProblem, A: Array, b: Array, weights: Sequence[float]) -> Quadratic:
    """That of weighted rows (m, n), (m,), all or reduced, and of the Tikhonov terms."""
    n = len(problem.columns)
    squares, pulls, rest = np.zeros(n), np.zeros(n), 0.0
    for term, weight in zip(problem.regularisers, weights, strict=True):
        tikhonov: Tikhonov = term  # type: ignore[assignment]  # `limits_of` has seen to it
        reference, scale = reference_and_scale(tikhonov.name, tikhonov.reference, tikhonov.scale, n)
        squares += weight / scale**2
        pulls += weight / scale**2 * reference
        rest += float(np.sum(weight / scale**2 * reference**2))
    at = pulls / np.where(squares > 0.0, squares, 1.0)
    return Quadratic(A, b, np.sqrt(squares), at, rest - float(np.sum(squares * at**2)))


def minimised(quadratic: Quadratic, limits: Limits) -> tuple[Array, Certificate, int] | None:
    """(the minimum (n,), its proof, sets tried); None where it cannot be proved this way."""
    lower, upper = limits.lower, limits.upper
    H, g = quadratic.normal
    size = np.sqrt(np.diag(H))
    if np.any(lower > upper) or not np.all(np.isfinite(size)) or not np.all(size > 0.0):
        return None
    scaled = H / (size[:, None] * size)
    low = high = np.zeros(len(lower), dtype=bool)
    fixed = lower == upper
    for tries in range(1, MOST + 1):
        free = ~(low | high | fixed)
        p = np.where(high, upper, np.where(low | fixed, lower, 0.0))
        try:
            inverse = np.linalg.inv(scaled[free][:, free])
        except np.linalg.LinAlgError:
            return None
        p[free] -= inverse @ ((H @ p - g)[free] / size[free]) / size[free]
        slope = H @ p - g
        now_low = ~fixed & np.where(low, slope > 0.0, free & (p < lower))
        now_high = ~fixed & np.where(high, slope < 0.0, free & (p > upper))
        if np.array_equal(now_low, low) and np.array_equal(now_high, high):
            # Once more with the rows: H has lost half of their digits.
            p[free] -= inverse @ (quadratic.slope(p)[free] / size[free]) / size[free]
            p = np.clip(p, lower, upper)
            proof = _proof(quadratic, limits, p)
            return (p, proof, tries) if proof.worst <= PROVED else None
        low, high = now_low, now_high
    return None


def _proof(quadratic: Quadratic, limits: Limits, p: Array) -> Certificate:
    """The figures of `Certificate` in the normal form, where p keeps the limits; their multipliers
    are what of the slope pushes against one."""
    slope = quadratic.slope(p)
    push = np.where(p <= limits.lower, np.maximum(slope, 0.0), 0.0)
    push += np.where(p >= limits.upper, np.minimum(slope, 0.0), 0.0)
    value = max(1.0, quadratic.value(p))
    left = slope - push
    # What of the rows is largest cannot be more than all of them together.
    scale = max(1.0, float(np.abs(slope).max(initial=0.0)), 2.0 * math.sqrt(value))
    over = np.maximum(limits.lower - p, p - limits.upper).max(initial=0.0)
    return Certificate(
        primal=0.0,
        dual=float(np.abs(left).max(initial=0.0)) / scale,
        gap=float(abs(left @ p)) / value,
        complementarity=0.0,
        primal_cone=float(max(0.0, over)) / max(1.0, float(np.abs(p).max(initial=0.0))),
        dual_cone=0.0,
    )
