"""The iterations of the literature, without trust region, bounds or convex step: additive (3.49)
and multiplicative (3.50–3.52), with an optional line search along the step and an optional
second-order correction. They are what the convex loop is measured against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.classic_solvers import svd_least_squares

FIRST_DIFFERENCE = 0.1  # of the step: where the second derivative along it is taken


class Rows(Protocol):
    """A comparison at one parameter vector."""

    @property
    def differences(self) -> tuple[Array, Array, tuple[str, ...]]:
        """(model − measured, weights, labels)."""

    def system(self) -> LinearSystem:
        """The rows linearised there."""


@dataclass(frozen=True)
class ClassicResult:
    """``p``, whether the steps fell below the tolerance (``converged``), their number, and the
    objective after each."""

    p: Array
    converged: bool
    iterations: int
    objective: tuple[float, ...]


def classic_loop(
    evaluate: Callable[[Array], Rows],
    p0: Array,
    form: str = "additive",
    solve: Callable[[Array, Array], Array] = svd_least_squares,
    line_search: bool = False,
    second_order: bool = False,
    tolerance: float = 1e-4,
    max_iterations: int = 30,
) -> ClassicResult:
    """Repeat p ← p + Δp ("additive") or 1 + p ← (1 + p)(1 + Δ) ("multiplicative"), Δ by ``solve(W
    A, W r)``, until ‖Δ‖ < ``tolerance`` (3.3.2).

    The multiplicative form solves for relative changes of the present factors, so its columns are A
    (1 + p). ``second_order`` adds half the acceleration along the step, from −½ r''[Δ, Δ] by a
    difference (Transtrum & Sethna 2012), where it is shorter than the step. ``line_search`` takes
    the best of ten step lengths from 1 to 2⁻⁹.

    Raises
    ------
    ValueError
        For another ``form``.
    """
    if form not in ("additive", "multiplicative"):
        raise ValueError(f"form {form!r} is neither additive nor multiplicative")
    p = np.asarray(p0, dtype=float)
    objective: list[float] = []
    for number in range(1, max_iterations + 1):
        try:
            point = evaluate(p)
        except ModelError:
            return ClassicResult(p, False, number - 1, tuple(objective))
        values, weights, _ = point.differences
        system = point.system()
        if not np.all(np.isfinite(system.A)):
            return ClassicResult(p, False, number - 1, tuple(objective))
        scale = 1.0 + p if form == "multiplicative" else np.ones(len(p))
        A = (weights[:, None] * system.A) * scale
        step = scale * solve(A, -weights * values)
        if second_order:
            step = step + _acceleration(evaluate, p, step, values, system.A, weights, scale, solve)
        length = _best_length(evaluate, p, step) if line_search else 1.0
        p = p + length * step
        objective.append(float(np.sum((weights * values) ** 2)))
        if np.linalg.norm(length * step) < tolerance:
            return ClassicResult(p, True, number, tuple(objective))
        if not np.all(np.isfinite(p)) or np.linalg.norm(p) > 1e3:
            return ClassicResult(p, False, number, tuple(objective))
    return ClassicResult(p, False, max_iterations, tuple(objective))


def _acceleration(
    evaluate: Callable[[Array], Rows],
    p: Array,
    step: Array,
    values: Array,
    A: Array,
    weights: Array,
    scale: Array,
    solve: Callable[[Array, Array], Array],
) -> Array:
    h = FIRST_DIFFERENCE
    try:
        ahead = evaluate(p + h * step).differences[0]
    except ModelError:
        return np.zeros(len(p))
    bend = 2.0 / h * ((ahead - values) / h - A @ step)
    extra = 0.5 * scale * solve((weights[:, None] * A) * scale, -weights * bend)
    return extra if np.linalg.norm(extra) < 0.375 * np.linalg.norm(step) else np.zeros(len(p))


def _best_length(evaluate: Callable[[Array], Rows], p: Array, step: Array) -> float:
    best, least = 2.0**-9, np.inf
    for k in range(10):
        try:
            values, weights, _ = evaluate(p + 2.0**-k * step).differences
        except ModelError:
            continue
        value = float(np.sum((weights * values) ** 2))
        if value < least:
            best, least = 2.0**-k, value
    return best
