"""The loop: linearise, solve the convex step inside a trust region, accept what really decreases
the objective."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Generic

import numpy as np

from cvxupdate.convex import (
    CompiledStep,
    SolverChoice,
    Step,
    StepProblem,
    WeightChoice,
    with_chosen_weight,
)
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.errors import InputError
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.options import Leader, Options
from cvxupdate.update.result import ClassicalResult
from cvxupdate.update.shortest import shortest
from cvxupdate.update.trial import (
    ENOUGH,
    GOOD,
    POOR,
    P,
    Residual,
    Trial,
    along_line,
    objective_at,
    slope_along,
    tried,
    with_second_order,
)

__all__ = ["Iteration", "Leader", "LoopResult", "Options", "Residual", "iterate", "objective_at"]

FEASIBLE = 1e-9  # a start that breaks no clause by more is taken as it is
SHORTEST = 1e-10  # trust region below which a step is rounding
PLAIN = 0.1  # decrease, of the objective, below which a step does as well alone
MEETS = "the model meets the recordings to {:.0e} of their deviations"
FLAT = "no shorter step decreases the objective: it is flat to rounding"
BACK = 1e-2  # of the trust region's unit: so near a minimum that is known, it is that one
REAL = 0.1  # a step is believed to lead there if it is not longer than BACK over this
SLOW = 0.9  # decrease of the objective to which part is slow
WIDEST = 0.9  # relative trust region at most: no factor 1 + p may change its sign


@dataclass(frozen=True)
class Iteration:
    """One line of the history; ``ratio`` is actual over predicted decrease, ``step`` its largest
    component in units of the trust region."""

    number: int
    objective: float
    ratio: float
    radius: float
    step: float
    accepted: bool
    p: tuple[float, ...]


@dataclass(frozen=True)
class LoopResult(Generic[P]):
    """Where the loop ended: ``status`` converged, stopped or infeasible; ``reason`` in words; the
    last ``step`` with its certificate; ``covariance`` (n, n) of the end, of methods that carry
    one; ``classical``: what made it, where it was no convex step."""

    start: P
    point: P
    step: Step
    status: str
    reason: str
    history: tuple[Iteration, ...]
    problem: StepProblem
    weight: WeightChoice | None
    covariance: Array | None = None
    classical: ClassicalResult | None = None


def iterate(
    residual: Residual[P],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
    renew: Callable[[P, StepProblem, P], StepProblem] | None = None,
    begin: P | None = None,
) -> LoopResult[P]:
    """Sequential convex programming with a box trust region (Conn, Gould and Toint 2000, ch. 6).

    The start is the point nearest to ``p0`` that satisfies the constraints. A step is accepted when
    the objective really falls (ratio of actual to predicted decrease above 1e-4); the box grows
    after a ratio above 0.75 and shrinks below 0.25. A weight that is a rule is chosen on the first
    system. ``renew`` (here, problem, moved) makes the next problem; ``begin`` is the point at p0.

    Raises
    ------
    ModelError
        When the model is no structure at the start.
    """
    initial = residual.evaluate(p0) if begin is None else begin
    point, step = _admissible_start(residual, problem, choice, p0, initial)
    if step is not None and step.status != "optimal":
        return LoopResult(initial, initial, step, step.status, step.says, (), problem, None)
    system = point.system()
    problem, weight = with_chosen_weight(problem, system, choice)
    compiled: CompiledStep | None = None
    here = Here(point, objective_at(problem, point), system)
    radius, history = options.radius, []
    status, reason = "stopped", f"the limit of {options.max_iterations} iterations was reached"
    for number in range(1, options.max_iterations + 1):
        compiled = _compiled(compiled, problem, here.system, choice)
        radius = min(radius, WIDEST) if options.relative else radius
        unit = options.unit(here.point.p)
        step = _step(compiled, problem, here, radius * unit, options, choice)
        ended = _ended(step, here, unit, options)
        if ended is not None:
            status, reason = ended
            break
        size = _largest(step.p - here.point.p, unit)
        trial = _attempt(residual, compiled, here, step, radius * unit, options)
        ratio = float((here.value - trial.objective) / (here.value - step.objective))
        taken, accepted = size, False
        if ratio > ENOUGH and trial.point is not None:
            taken, accepted = _largest(trial.point.p - here.point.p, unit), True
            if renew is not None:
                problem = renew(here.point, problem, trial.point)
            here = Here(trial.point, objective_at(problem, trial.point))  # a new step begins
        history.append(Iteration(number, here.value, ratio, radius, taken, accepted, here.p))
        if progress is not None:
            progress(history[-1])
        radius = _next_radius(radius, ratio, size, taken)
        ended = _ended_after(history, here, radius, options)
        if ended is not None:
            status, reason = ended
            break
    last = _taken(step)
    return LoopResult(initial, here.point, last, status, reason, tuple(history), problem, weight)


@dataclass(frozen=True)
class Here(Generic[P]):
    """Where the loop stands: the point, its true objective, its rows ``linear`` where known."""

    point: P
    value: float
    linear: LinearSystem | None = None

    @property
    def p(self) -> tuple[float, ...]:
        """Parameter values."""
        return tuple(self.point.p.tolist())

    @cached_property
    def system(self) -> LinearSystem:
        """The rows linearised there."""
        return self.point.system() if self.linear is None else self.linear


def _step(
    compiled: CompiledStep,
    problem: StepProblem,
    here: Here[P],
    radius: Array,
    options: Options,
    choice: SolverChoice,
) -> Step:
    """The convex step within ``radius`` (n,), or the shortest that is as good."""
    step = compiled.solve(here.system, centre=here.point.p, radius=radius)
    if options.shortest and step.status == "optimal":
        return shortest(problem, here.system, step, here.point.p, radius, choice)
    return step


def _compiled(
    before: CompiledStep | None, problem: StepProblem, system: LinearSystem, choice: SolverChoice
) -> CompiledStep:
    """The step compiled before, where it is of this problem and holds as many rows."""
    rows = len(system.rows)
    if before is not None and before.problem is problem and rows <= before.rows:
        return before
    return CompiledStep(problem, rows, choice)


def _taken(step: Step | None) -> Step:
    """The last step; InputError where there was none."""
    if step is None:
        raise InputError("the loop was given no iteration. Set max_iterations to 1 or more.")
    return step


def _largest(move: Array, unit: Array) -> float:
    """The largest component of a move, in units of the trust region."""
    return float(np.max(np.abs(move) / unit, initial=0.0))


def _admissible_start(
    residual: Residual[P], problem: StepProblem, choice: SolverChoice, p0: Array, initial: P
) -> tuple[P, Step | None]:
    """The point nearest to ``p0`` that satisfies the constraints, with the step that found it;
    ``initial`` (that at ``p0``) and None where it does so itself."""
    if max((violation(c, p0) for c in problem.clauses), default=0.0) <= FEASIBLE:
        return initial, None
    step = CompiledStep(problem, 1, choice).nearest(p0)
    return (residual.evaluate(step.p, initial) if step.status == "optimal" else initial), step


def _met(here: Here[P], options: Options) -> bool:
    """Whether nothing but what the rows are not known to is left."""
    return here.value <= options.met**2 * len(here.point.differences[0])


def _ended_after(
    history: Sequence[Iteration], here: Here[P], radius: float, options: Options
) -> tuple[str, str] | None:
    """Status and reason where the loop ends with an iteration: nothing is left, no step is short
    enough, or the last ones did too little for so many."""
    if radius < SHORTEST * max(1.0, _largest(here.point.p, options.unit(here.point.p))):
        return "converged", FLAT
    if _met(here, options):
        return "converged", MEETS.format(options.met)
    n = options.patience
    if n is not None and len(history) > n and here.value > SLOW * history[-1 - n].objective:
        return "stopped", f"{n} iterations lowered the objective by less than a tenth"
    return None


def _ended(step: Step, here: Here[P], unit: Array, options: Options) -> tuple[str, str] | None:
    """Status and reason where the loop ends at this step, before it is tried."""
    if step.status != "optimal":
        return step.status, step.says
    value = here.value
    if value <= options.met**2 * len(here.system.rows):
        return (
            "converged",
            f"the model meets the recordings to {options.met:.0e} of their deviations",
        )
    predicted = value - step.objective
    if predicted <= options.tolerance * value:
        return "converged", (
            "the step predicts a further decrease of only "
            f"{max(predicted, 0.0) / value:.1e} of the objective"
        )
    if _largest(step.p - here.point.p, unit) <= options.still:
        return "converged", (
            f"the step moves no parameter by more than {options.still:.0e} of its unit, no more "
            "than the modes are known"
        )
    if options.known and step.objective > options.below:
        back = _largest(step.p - np.array(options.known), unit)
        if max(back, REAL * _largest(step.p - here.point.p, unit)) < BACK:
            return "converged", "the step leads back to a minimum that is known"
    return None


def _attempt(
    residual: Residual[P],
    compiled: CompiledStep,
    here: Here[P],
    step: Step,
    radius: Array,
    options: Options,
) -> Trial[P]:
    """The best of what the options allow: the step with second-order terms, the step itself, points
    along it."""
    problem, point, value = compiled.problem, here.point, here.value
    predicted = value - step.objective
    trial: Trial[P] = Trial(None, np.inf)
    if options.ahead is not None and predicted > PLAIN * value:
        trial = options.ahead.lead(residual, compiled, point, value, radius, options)
    if options.second_order and trial.point is None:
        trial = with_second_order(residual, compiled, point, here.system, step.p, radius)
    if value - trial.objective < (POOR if options.ahead else GOOD) * predicted:
        trial = min(tried(residual, problem, point, step.p), trial, key=lambda t: t.objective)
    if options.line_search and value - trial.objective < POOR * predicted:
        end = step.p if trial.point is None else trial.point.p
        slope = slope_along(problem, here.system, point.p, end)
        evaluate = partial(tried, residual, problem, point)
        trial = along_line(evaluate, point.p, end, value, slope, trial)
    return trial


def _next_radius(radius: float, ratio: float, size: float, taken: float) -> float:
    """The trust region after a step of ``size`` of which ``taken`` was taken."""
    if ratio < POOR:
        return 0.25 * size
    if ratio > GOOD and taken > 0.99 * radius:
        return 2.0 * radius
    return radius
