"""What may follow a convex step before it is judged: second-order terms along it, and a line
search. Both end where the constraints hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from cvxupdate.convex import CompiledStep, StepProblem
from cvxupdate.errors import ModelError
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


class Residual(Protocol[P]):
    """Anything that can be evaluated at ``p``, given the point before (to follow modes)."""

    def evaluate(self, p: Array, before: P | None = None) -> P:
        """The comparison at ``p``; ModelError where the model is no structure."""


POOR = 0.25
"""Ratio of actual to predicted decrease below which the line is searched, and the trust region
shrinks."""
GOOD = 0.75
"""Ratio above which nothing else is tried."""
HALVINGS = 6
ENOUGH = 1e-4
"""Fraction of the predicted decrease that counts as one."""
AHEAD = 0.1
"""Fraction of the step over which the second derivative along it is taken."""
DOMINANT = 0.75
"""Second-order terms that move the step by more than this fraction of it are not believed."""


@dataclass(frozen=True)
class Trial(Generic[P]):
    """A point that was tried and its ``objective``; None and inf where the model is no
    structure."""

    point: P | None
    objective: float


def objective_at(problem: StepProblem, point: Point, present: Array | None = None) -> float:
    """The true (not linearised) objective at a point that a step from ``present`` (n,) leads to
    (None: from itself)."""
    values, weights, _ = point.differences
    begin = point.p if present is None else present
    return problem.loss.value(weights * values) + problem.penalty(point.p, begin)


def tried(
    residual: Residual[P], problem: StepProblem, point: P, p: Array, present: Array | None = None
) -> Trial[P]:
    """``p`` evaluated after ``point``; the step to it begins at ``present`` (None: there too)."""
    try:
        found = residual.evaluate(p, point)
        return Trial(found, objective_at(problem, found, point.p if present is None else present))
    except ModelError:
        return Trial(None, np.inf)


def with_second_order(
    residual: Residual[P],
    compiled: CompiledStep,
    point: P,
    system: LinearSystem,
    p: Array,
    radius: Array,
) -> Trial[P]:
    """The convex step from ``point`` to ``p`` solved again with the second-order term along it in
    its data, and tried.

    With δ the step, r″[δ, δ] comes from the rows a tenth along it (Transtrum and Sethna 2012); the
    step is solved again for r + A (q − p) + ½ r″[δ, δ] under the same constraints and trust region.
    One more convex step and two evaluations. Nothing (inf) where that is no small correction.
    """
    nothing: Trial[P] = Trial(None, np.inf)
    ahead = tried(residual, compiled.problem, point, point.p + AHEAD * (p - point.p)).point
    if ahead is None or ahead.differences[2] != system.rows:
        return nothing
    curved = (ahead.differences[0] - (system.A @ ahead.p - system.b)) / AHEAD**2
    again = compiled.solve(replace(system, b=system.b - curved), centre=point.p, radius=radius)
    if again.status != "optimal" or np.linalg.norm(again.p - p) > DOMINANT * np.linalg.norm(
        p - point.p
    ):
        return nothing
    return tried(residual, compiled.problem, point, again.p)


def along_line(
    evaluate: Callable[[Array], Trial[P]],
    start: Array,
    end: Array,
    value: float,
    slope: float,
    trial: Trial[P],
) -> Trial[P]:
    """The best of a few points between ``start`` and ``end`` (``trial``), which all satisfy
    constraints that are convex.

    ``value`` and ``slope`` (< 0) are the objective and its derivative at the start along the whole
    step. A fraction t of the step is enough where the objective falls by 1e-4 t slope (Armijo
    1966); the next t is the minimum of the parabola through what is known, within [0.1, 0.5] of the
    last, half where nothing is known. Where the whole step was good enough but less than promised,
    the parabola's minimum is tried once.
    """
    t, best = 1.0, trial
    for _ in range(HALVINGS):
        enough = best.objective <= value + ENOUGH * t * slope
        excess = best.objective - value - t * slope
        wanted = -0.5 * slope * t**2 / excess if np.isfinite(excess) and excess > 0.0 else 0.5 * t
        if enough and wanted > 0.9 * t:
            break
        nearer = float(np.clip(wanted, 0.1 * t, 0.9 * t if enough else 0.5 * t))
        other = evaluate(start + nearer * (end - start))
        if enough:
            return other if other.objective < best.objective else best
        t, best = nearer, other
    return best if best.objective < trial.objective else trial


def slope_along(problem: StepProblem, system: LinearSystem, start: Array, end: Array) -> float:
    """The derivative of the linearised objective at ``start`` towards ``end``, for the whole step,
    from a difference over 1e-6 of it: the model is convex."""
    h = 1e-6
    ahead, here = (
        problem.objective(system, q, present=start) for q in (start + h * (end - start), start)
    )
    return (ahead - here) / h
