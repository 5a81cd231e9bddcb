"""Method ``rfm`` with the weights of the force balance taken anew at every step.

With the dynamic flexibility at its own point the balance equals the output error there, so each
step is a Gauss–Newton step of the output error on the balance, which is far less bent than the
responses are: no loop on one set of weights is carried to an end that the next set moves again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.residual.contraction import derivatives
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.residual.frf_output import output_rows
from cvxupdate.system import Array
from cvxupdate.update.trial import GOOD, POOR
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

FORESEEN = 0.3
"""Error of a line (of its r.m.s.) up to which the model has its resonances in the right order, so
that the line above it may be fitted too."""
AHEAD = 2
"""Lines fitted beyond those: of a mode between two of them, one on either side."""
FIRST_RADIUS = 3.0
"""Trust region where the problem file gives none: far, because a balance is nearly linear."""
EXACT = 1e-3
"""Residual (r.m.s., in deviations) below which nothing is left to find."""
TINY = 1e-9
"""Trust region below which no step counts."""


@dataclass(frozen=True)
class _Best:
    """The best point so far, its objective in its own weights, and the loop that led there."""

    p: Array
    value: float
    point: FrfPoint


def fit_stepwise(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    low: bool = False,
    p0: Array | None = None,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[FrfPoint]:
    """Steps of the flexibility-weighted balance, each in the weights of its own start, until one
    lowers the output error of all lines by less than ``options.tolerance`` of it, or one in the
    whole trust region foresees that it would (as every loop here ends: it is not made, and not
    counted).

    ``options.radius`` is the largest trust region, too: it shrinks after a poor step and recovers.
    ``low``: the first step is on the two lowest lines of each recording; each further one on those
    up to the first that the model misses by more than `FORESEEN`, and two more.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model as it stands.
    """
    p = model.zero() if p0 is None else p0
    radius, history = options.radius, list[Iteration]()
    start = best = _at(model, data, problem, p)
    counts = [AHEAD if low else len(d.frequency) for d in data]
    order = [np.argsort(d.frequency) for d in data]
    status, reason = "stopped", f"the limit of {options.max_iterations} iterations was reached"
    while True:
        part = [d.at(np.sort(o[:n])) for d, o, n in zip(data, order, counts, strict=True)]
        whole = all(n == len(d.frequency) for n, d in zip(counts, data, strict=True))
        once = _once(options, radius, whole)
        residual = FrfResidual(model, tuple(part), "flexibility", p)
        loop = iterate(residual, problem, choice, once, p, progress)
        problem = loop.problem
        if loop.status == "infeasible":
            return loop
        history += [replace(h, number=len(history) + 1) for h in loop.history]
        accepted = bool(loop.history) and loop.history[-1].accepted
        radius = _next(radius, options.radius, loop.history)
        if accepted:
            p = loop.point.p
            now, before = _at(model, data, problem, p), best
            best = min((best, now), key=lambda b: b.value)
            ended = _ended(before, now, options.tolerance if whole else None)
            if ended:
                status, reason = "converged", ended
                if now is not best:  # tried, but the end is the point before
                    history[-1] = replace(history[-1], accepted=False, p=tuple(best.p.tolist()))
                break
        elif whole and (not loop.history or radius < TINY):
            status, reason = "converged", loop.reason
            break
        if len(history) >= options.max_iterations:
            break
        counts = _counts(model, data, order, counts, p) if low else counts
    end = (start.point, best.point, loop.step, status, reason, tuple(history))
    return LoopResult(*end, problem, loop.weight)


def _once(options: Options, radius: float, whole: bool) -> Options:
    """One step. What it foresees may end the loop where it is of the ``whole`` data and in the
    whole trust region: a short one foresees little wherever it is."""
    tolerance = options.tolerance if whole and radius >= options.radius else 0.0
    return replace(options, max_iterations=1, radius=radius, tolerance=tolerance)


def _ended(before: _Best, now: _Best, tolerance: float | None) -> str:
    """Why the loop ends with an accepted step; empty where it goes on. No ``tolerance``: not all
    lines are fitted yet."""
    if now.value <= EXACT**2 * len(now.point.values):
        return "the model meets the recordings"
    if tolerance is not None and before.value < now.value:
        return "a further step raised the output error, and was not kept"
    if tolerance is not None and before.value - now.value <= tolerance * before.value:
        return f"the last step lowered the output error by less than {tolerance:.1g} of it"
    return ""


def _at(model: Model, data: Sequence[FrfData], problem: StepProblem, p: Array) -> _Best:
    point = FrfResidual(model, tuple(data), "flexibility", p).evaluate(p)
    return _Best(p, objective_at(problem, point), point)


def _next(radius: float, most: float, history: Sequence[Iteration]) -> float:
    """The trust region after one step, as `trust_region` has it."""
    if not history:
        return 0.25 * radius
    h = history[-1]
    if h.ratio < POOR:
        return 0.25 * min(h.step, radius) if h.step > 0.0 else 0.25 * radius
    return min(most, 2.0 * radius) if h.ratio > GOOD and h.step > 0.99 * radius else radius


def _counts(
    model: Model, data: Sequence[FrfData], order: Sequence[Index], counts: Sequence[int], p: Array
) -> list[int]:
    """How many of the lowest lines of each recording the next step fits."""
    m, d, out = matrices_with_damping(model, p), derivatives(model, p), []
    for one, by, count in zip(data, order, counts, strict=True):
        try:
            left = np.concatenate([rows for rows, _ in output_rows(m, d, one)])
        except ModelError:
            out.append(count)
            continue
        used = one.used[None]
        error = np.linalg.norm(np.where(used, left, 0.0), axis=(1, 2))
        missed = error > FORESEEN * np.linalg.norm(np.where(used, one.X, 0.0), axis=(1, 2))
        foreseen = int(np.argmax(np.append(missed[by], True)))
        out.append(max(count, min(len(by), foreseen + AHEAD)))
    return out
