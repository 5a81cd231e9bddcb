"""The loop: linearise, solve the convex step inside a trust region, accept what really decreases the objective."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from cvxupdate.convex import CompiledStep, SolverChoice, Step, StepProblem, WeightChoice, with_chosen_weight
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.errors import InputError, ModelError
from cvxupdate.system import Array, LinearSystem


class Point(Protocol):
    """A comparison at one parameter vector: what a residual gives to the loop."""

    @property
    def p(self) -> Array:
        """Parameter values (n,)."""

    @property
    def differences(self) -> tuple[Array, Array, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows."""

    def system(self) -> LinearSystem:
        """The rows linearised at ``p``."""


P = TypeVar("P", bound=Point)
FEASIBLE = 1e-9  # a start that breaks no clause by more is taken as it is
EXACT = 1e-10  # of the stated deviations: a residual below is rounding
SHORTEST = 1e-10  # trust region below which a step is rounding


class Residual(Protocol[P]):
    """Anything that can be evaluated at ``p``, given the point before (to follow modes)."""

    def evaluate(self, p: Array, before: P | None = None) -> P:
        """The comparison at ``p``; ModelError where the model is no structure."""


@dataclass(frozen=True)
class Options:
    """``tolerance``: relative decrease of the objective below which the loop ends; ``radius``: first trust region, in units of p."""

    tolerance: float = 1e-6
    max_iterations: int = 30
    radius: float = 0.3


@dataclass(frozen=True)
class Iteration:
    """One line of the history; ``ratio`` is actual over predicted decrease."""

    number: int
    objective: float
    ratio: float
    radius: float
    step: float
    accepted: bool
    p: tuple[float, ...]


@dataclass(frozen=True)
class LoopResult(Generic[P]):
    """Where the loop ended: ``status`` converged, stopped or infeasible; ``reason`` in words; the last ``step`` with its certificate."""

    start: P
    point: P
    step: Step
    status: str
    reason: str
    history: tuple[Iteration, ...]
    problem: StepProblem
    weight: WeightChoice | None


def objective_at(problem: StepProblem, point: Point) -> float:
    """The true (not linearised) objective at a point."""
    values, weights, _ = point.differences
    penalty = sum(w * r.value(point.p, problem.columns) for w, r in zip(problem.weights, problem.regularisers, strict=True))
    return problem.loss.value(weights * values) + penalty


def iterate(residual: Residual[P], problem: StepProblem, choice: SolverChoice, options: Options, p0: Array,
            progress: Callable[[Iteration], None] | None = None) -> LoopResult[P]:
    """Sequential convex programming with a box trust region (Conn, Gould and Toint 2000, ch. 6).

    The start is the point nearest to ``p0`` that satisfies the constraints. A step is accepted when the objective really falls (ratio of
    actual to predicted decrease above 1e-4); the box grows after a ratio above 0.75 and shrinks below 0.25. A weight that is still a rule
    is chosen on the first linear system.

    Raises
    ------
    ModelError
        When the model is no structure at the start.
    """
    initial = residual.evaluate(p0)
    point, step = initial, None
    if max((violation(c, p0) for c in problem.clauses), default=0.0) > FEASIBLE:
        step = CompiledStep(problem, 1, choice).nearest(p0)
        if step.status != "optimal":
            return LoopResult(initial, initial, step, step.status, step.says, (), problem, None)
        point = residual.evaluate(step.p, initial)
    system = point.system()
    problem, weight = with_chosen_weight(problem, system, choice)
    compiled = CompiledStep(problem, len(system.rows), choice)
    value = objective_at(problem, point)
    exact = EXACT**2 * len(system.rows)
    radius, history = options.radius, []
    status, reason = "stopped", f"the limit of {options.max_iterations} iterations was reached"
    for number in range(1, options.max_iterations + 1):
        if len(system.rows) > compiled.rows:
            compiled = CompiledStep(problem, len(system.rows), choice)
        step = compiled.solve(system, centre=point.p, radius=radius)
        if step.status != "optimal":
            status, reason = step.status, step.says
            break
        predicted, size = value - step.objective, float(np.max(np.abs(step.p - point.p), initial=0.0))
        if value <= exact:
            status, reason = "converged", f"the model meets the recordings to {EXACT:.0e} of their deviations"
            break
        if predicted <= options.tolerance * value:
            status, reason = "converged", f"the step predicts a further decrease of only {max(predicted, 0.0) / value:.1e} of the objective"
            break
        try:
            trial = residual.evaluate(step.p, point)
            reached = objective_at(problem, trial)
        except ModelError:
            trial, reached = point, np.inf  # no structure there: a shorter step
        ratio = (value - reached) / predicted
        accepted = bool(ratio > 1e-4)
        here = trial if accepted else point
        history.append(Iteration(number, reached if accepted else value, float(ratio), radius, size, accepted, tuple(here.p.tolist())))
        if progress is not None:
            progress(history[-1])
        if accepted:
            point, value = trial, reached
            system = point.system()
        if ratio < 0.25:
            radius = 0.25 * size
        elif ratio > 0.75 and size > 0.99 * radius:
            radius *= 2.0
        if radius < SHORTEST * max(1.0, float(np.max(np.abs(point.p), initial=0.0))):
            status, reason = "converged", "no shorter step decreases the objective: it is flat to rounding"
            break
    if step is None:
        raise InputError("the loop was given no iteration. Set max_iterations to 1 or more.")
    return LoopResult(initial, point, step, status, reason, tuple(history), problem, weight)
