"""The weight of a regulariser by a rule: L-curve, generalised cross-validation, discrepancy
principle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..system import Array, LinearSystem
from .constraints.clauses import LinearClause, is_active, stack
from .losses import LeastSquares
from .problem import StepProblem
from .regularisers.common import RULES, Regulariser
from .solvers import SolverChoice
from .step import CompiledStep

POINTS = 33


@dataclass(frozen=True, eq=False)
class WeightChoice:
    """A chosen weight and the sweep behind it.

    ``weight`` the number; ``rule`` the rule; ``curve`` (points, 4): weight, loss, penalty without
    its weight, score, with the weights rising. The score is the curvature ("l-curve", largest is
    best), the GCV function ("gcv", least is best) or loss/rows ("discrepancy", 1 is best); NaN
    where it has no value. ``note`` says when the rule found nothing inside the sweep.
    """

    weight: float
    rule: str
    curve: Array
    note: str = ""


@dataclass(frozen=True, eq=False)
class Sweep:
    """One regulariser's weight as the variable: a compiled step that solves at any weight."""

    problem: StepProblem
    system: LinearSystem
    index: int
    step: CompiledStep
    R: Array
    d: Array

    @property
    def regulariser(self) -> Regulariser:
        """The regulariser whose weight is sought."""
        return self.problem.regularisers[self.index]

    def at(self, weight: float) -> tuple[Array, float, float]:
        """p (n,), the loss on all rows and the penalty at a weight; NaN where the solver
        stopped."""
        weights = [
            weight if k == self.index else float(reg.weight)
            for k, reg in enumerate(self.problem.regularisers)
        ]
        found = self.step.solve_reduced(self.R, self.d, weights)
        if found.status == "infeasible":
            raise InputError(f"the weight cannot be chosen: {found.says}")
        if found.status != "optimal":
            nothing = np.full(len(self.problem.columns), np.nan)
            return nothing, np.nan, np.nan
        loss = self.problem.loss.value(self.system.residual(found.p))
        return found.p, loss, self.regulariser.value(found.p, self.problem.columns)

    def degrees_of_freedom(self, p: Array, weight: float) -> float:
        """Effective number of parameters at p, within the linear clauses that are active there."""
        held = [
            c for c in self.problem.clauses if isinstance(c, LinearClause) and is_active(c, p, 1e-6)
        ]
        active = stack(held, p.size).C.toarray()
        return self.regulariser.degrees_of_freedom(self.R, p, weight, active, self.problem.columns)


def choose_weight(
    problem: StepProblem, system: LinearSystem, rule: str, solver: SolverChoice | None = None
) -> WeightChoice:
    """Choose the weight of the problem's regulariser (of the one whose weight is a rule, else of
    the first).

    The compiled step is swept over a logarithmic grid; "l-curve" takes the point of largest
    curvature of log penalty against log loss (Hansen & O'Leary 1993; thesis 4.3), "gcv" the least
    m·loss/(m − dof)² (Golub, Heath & Wahba 1979), "discrepancy" the largest weight whose weighted
    squared residual is at most the number of rows (Morozov 1966).

    Raises
    ------
    InputError
        No regulariser, an unknown rule, or "gcv" or "discrepancy" with a loss other than least
        squares.
    """
    index = _open_weight(problem, rule)
    problem.check(system)
    R, d, _ = problem.loss.reduce(*system.weighted())
    step = CompiledStep(problem, len(system.rows), solver or SolverChoice())
    sweep = Sweep(problem, system, index, step, R, d)
    low, high = sweep.regulariser.weight_range(R, d, problem.columns)
    grid = np.geomspace(low, high, POINTS)
    points = [sweep.at(float(w)) for w in grid]
    loss, penalty = np.array([x[1] for x in points]), np.array([x[2] for x in points])
    if not np.any(np.isfinite(loss)):
        raise InputError(
            "the weight cannot be chosen: the solver reached no optimum at any weight; try "
            "another solver."
        )
    if rule == "l-curve":
        return _corner(grid, loss, penalty)
    if rule == "gcv":
        freedom = np.array(
            [
                sweep.degrees_of_freedom(x[0], w) if np.isfinite(x[1]) else np.nan
                for w, x in zip(grid, points, strict=True)
            ]
        )
        return _least_gcv(grid, loss, penalty, freedom, system.count)
    return _discrepancy(sweep, grid, loss, penalty, system.count)


def _open_weight(problem: StepProblem, rule: str) -> int:
    """Which regulariser's weight the rule may choose; InputError where there is none, or the rule
    does not apply."""
    if rule not in RULES:
        raise InputError(
            f"weight rule {rule!r} is not known; choose one of {', '.join(map(repr, RULES))}, "
            "or a number."
        )
    if not problem.regularisers:
        raise InputError(
            f"the weight rule {rule!r} needs a regulariser; add a [regularisation] table."
        )
    if rule != "l-curve" and not isinstance(problem.loss, LeastSquares):
        raise InputError(
            f"the weight rule {rule!r} is defined for the least-squares loss only; choose "
            '"l-curve" or a number.'
        )
    open_ones = [k for k, reg in enumerate(problem.regularisers) if isinstance(reg.weight, str)]
    if len(open_ones) > 1:
        raise InputError(
            "only one regulariser can have its weight chosen by a rule; give the others a number."
        )
    return open_ones[0] if open_ones else 0


def with_chosen_weight(
    problem: StepProblem, system: LinearSystem, solver: SolverChoice | None = None
) -> tuple[StepProblem, WeightChoice | None]:
    """The problem with a weight that was a rule turned into a number, and the choice; unchanged
    when it has no rule."""
    for k, regulariser in enumerate(problem.regularisers):
        if isinstance(regulariser.weight, str):
            choice = choose_weight(problem, system, regulariser.weight, solver)
            settled: Any = regulariser
            regularisers = list(problem.regularisers)
            regularisers[k] = replace(settled, weight=choice.weight)
            return replace(problem, regularisers=tuple(regularisers)), choice
    return problem, None


def curvature(x: Array, y: Array, step: float) -> Array:
    """Signed curvature of the polyline (x, y), (points,), from points ``step`` of arc length before
    and after (Menger).

    Positive where the line turns left; NaN within ``step`` of an end.
    """
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    before = np.array([np.interp(s - step, s, x), np.interp(s - step, s, y)])
    after = np.array([np.interp(s + step, s, x), np.interp(s + step, s, y)])
    here = np.array([x, y])
    a, b = here - before, after - here
    turn = a[0] * b[1] - a[1] * b[0]
    sides = (
        np.linalg.norm(a, axis=0)
        * np.linalg.norm(b, axis=0)
        * np.linalg.norm(after - before, axis=0)
    )
    inside = (s >= step) & (s <= s[-1] - step) & (sides > 0)
    return np.where(inside, 2 * turn / np.where(sides > 0, sides, 1.0), np.nan)


def _corner(grid: Array, loss: Array, penalty: Array) -> WeightChoice:
    usable = (
        np.isfinite(loss)
        & (loss > 0)
        & (penalty > 1e-12 * np.nanmax(penalty, initial=0.0))
        & (penalty > 0)
    )
    score = np.full(grid.size, np.nan)
    if usable.sum() >= 5:
        x, y = np.log(loss[usable]), np.log(penalty[usable])
        # At the scale of a twentieth of the curve, so that a ripple is not taken for the corner.
        score[usable] = curvature(x, y, float(np.sum(np.hypot(np.diff(x), np.diff(y)))) / 20)
    curve = np.column_stack([grid, loss, penalty, score])
    if not np.nanmax(score, initial=-np.inf) > 0:
        note = (
            "the L-curve has no corner: the fit is exact or nothing moves; the least weight is "
            "taken"
        )
        return WeightChoice(float(grid[0]), "l-curve", curve, note)
    # Many weights share the corner when little changes there; the middle one of those is taken.
    sharp = np.nan_to_num(score, nan=-np.inf) >= 0.8 * np.nanmax(score)
    top = int(np.nanargmax(score))
    first = top - int(np.argmin(np.append(sharp[top::-1], False))) + 1
    last = top + int(np.argmin(np.append(sharp[top:], False))) - 1
    return WeightChoice(float(np.sqrt(grid[first] * grid[last])), "l-curve", curve)


def _least_gcv(grid: Array, loss: Array, penalty: Array, freedom: Array, rows: int) -> WeightChoice:
    spare = rows - freedom
    score = np.where(
        spare > 1e-6 * rows, rows * loss / np.where(spare > 0, spare, 1.0) ** 2, np.nan
    )
    if not np.any(np.isfinite(score)):
        raise InputError(
            f'the weight rule "gcv" needs more rows ({rows}) than effective parameters; '
            'choose "l-curve".'
        )
    return WeightChoice(
        float(grid[int(np.nanargmin(score))]), "gcv", np.column_stack([grid, loss, penalty, score])
    )


def _discrepancy(sweep: Sweep, grid: Array, loss: Array, penalty: Array, rows: int) -> WeightChoice:
    curve = np.column_stack([grid, loss, penalty, loss / rows])
    within = np.flatnonzero(np.nan_to_num(loss, nan=np.inf) <= rows)
    if within.size == 0:
        return WeightChoice(
            float(grid[0]),
            "discrepancy",
            curve,
            "no weight brings the residual down to the stated deviations; "
            "the least weight is taken: the deviations are too small or the model lacks something",
        )
    last = int(within[-1])
    if last == grid.size - 1:
        return WeightChoice(
            float(grid[-1]),
            "discrepancy",
            curve,
            "the parameters at their reference already agree within the deviations",
        )
    low, high = np.log(grid[last]), np.log(grid[last + 1])
    for _ in range(30):
        middle = 0.5 * (low + high)
        value = sweep.at(float(np.exp(middle)))[1]
        low, high = (middle, high) if value <= rows else (low, middle)
        if abs(value - rows) <= 1e-4 * rows:
            break
    return WeightChoice(float(np.exp(low)), "discrepancy", curve)
