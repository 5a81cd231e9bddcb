"""The loops of method ``rfm``: force balance with its weights taken anew, ended by the output
error; or the output error on a reduced basis that is made anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.residual.frf_reduced import Basis, ReducedResidual, make_basis
from cvxupdate.system import Array
from cvxupdate.update.rfm_filter import fit_filtered
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

EXACT = 1e-3
"""Largest weighted residual (r.m.s.) at which the equations hold: nothing is left for other weights
to change."""
SETTLED = 1e-3
"""Change of p below which taking the weights anew changes nothing."""
PASSES = 3
REWEIGHTED = 12
"""Times that the weights of a force balance alone are taken anew."""
REFRESHES = 15
ROUND = 4
"""Steps on one basis."""
MOVED = 1e-4
"""Change of p since the basis was made below which it serves."""
NEAR_RADIUS = 0.1
"""First trust region of the output error: it is far from linear where a resonance crosses a
line."""


def fit_responses(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    kind: str = "auto",
    p0: Array | None = None,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[FrfPoint]:
    """The loop over FRFs: ``kind`` one of `residual.frf.KINDS`, "filter" (`update.rfm_filter`) or
    "auto". A force balance (2.110, 2.111, 2.113; 3.7 to 3.9; 3.13 to 3.26, exactly reduced) has its
    rows' covariance, which depends on p, taken anew at each solution, until p settles; the output
    error (2.114, 2.115) has the deviations of the recordings.

    "auto": force balance weighted by the dynamic flexibility (3.34 to 3.37; exactly linear where
    every DOF is measured), then the output error from the best point so far; what the first gains
    is kept only where the output error agrees, so the end is never worse than the start.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model as it stands.
    """
    start = model.zero() if p0 is None else p0
    if kind == "receptance":
        output = FrfResidual(model, tuple(data), kind)
        return iterate(output, problem, choice, options, start, progress)
    if kind == "filter":
        return fit_filtered(model, data, problem, choice, options, start, progress)
    if kind != "auto":
        return _reweighted(model, tuple(data), problem, choice, options, kind, start, progress)
    output = FrfResidual(model, tuple(data), "receptance")
    first = output.evaluate(start)
    history: list[Iteration] = []
    best, p, loop = start, start, None
    for _ in range(PASSES):
        loop = iterate(
            FrfResidual(model, tuple(data), "flexibility", p), problem, choice, options, p, progress
        )
        history += _renumbered(loop.history, len(history))
        if loop.status == "infeasible":
            return replace(loop, start=first)
        moved = float(np.max(np.abs(loop.point.p - p), initial=0.0))
        p = loop.point.p
        best = _better(output, loop.problem, first, best, p)
        if _holds(loop.point) and loop.status == "converged":
            return replace(loop, start=first, point=output.evaluate(p), history=tuple(history))
        if moved <= SETTLED or best is not p:
            break
    last = iterate(
        output,
        problem,
        choice,
        replace(options, radius=min(options.radius, NEAR_RADIUS)),
        best,
        progress,
    )
    history += _renumbered(last.history, len(history))
    return replace(last, start=first, history=tuple(history))


def _reweighted(
    model: Model,
    data: tuple[FrfData, ...],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    kind: str,
    start: Array,
    progress: Callable[[Iteration], None] | None,
) -> LoopResult[FrfPoint]:
    """One loop after another, each with the covariance of the rows (or the instruments) at the last
    one's end; start and end are compared in the last weights."""
    history: list[Iteration] = []
    p = start
    for _ in range(REWEIGHTED):
        residual = FrfResidual(model, data, kind, p)
        loop = iterate(residual, problem, choice, options, p, progress)
        history += _renumbered(loop.history, len(history))
        moved = float(np.max(np.abs(loop.point.p - p), initial=0.0))
        p = loop.point.p
        # as many instruments as parameters: their equations hold whatever the instruments are
        exact = kind != "instrumental" and _holds(loop.point)
        if loop.status != "converged" or exact or moved <= SETTLED:
            break
    else:
        loop = replace(
            loop,
            status="stopped",
            reason=f"the weights still changed after they were taken anew {REWEIGHTED} times",
        )
    if kind == "instrumental" and loop.status == "converged":
        loop = replace(loop, reason="the instruments changed no more with the parameters")
    return replace(loop, start=residual.evaluate(start), history=tuple(history))


def fit_reduced(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array | None = None,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[FrfPoint]:
    """The output error on a reduced basis of modes and residual vectors, made anew whenever p has
    moved; every basis is judged by the full model.

    A round is a few steps on one basis. It is kept when the full objective falls, else tried again
    with a quarter of the trust region. The end is where a round converges with p moved by less than
    ``MOVED``.

    Raises
    ------
    ModelError
        When the model is no structure, or has too many modes in the band.
    """
    start = model.zero() if p0 is None else p0
    output = FrfResidual(model, tuple(data), "receptance")
    first = point = output.evaluate(start)
    history: list[Iteration] = []
    radius, basis = min(options.radius, NEAR_RADIUS), None
    status, reason = "stopped", f"the parameters still moved after {REFRESHES} bases"
    for _ in range(REFRESHES):
        basis = _basis_at(model, data, point.p) if basis is None else basis
        loop = iterate(
            ReducedResidual(output, basis),
            problem,
            choice,
            replace(options, radius=radius, max_iterations=ROUND),
            point.p,
            progress,
        )
        history += _renumbered(loop.history, len(history))
        if loop.status == "infeasible":
            status, reason = loop.status, loop.reason
            break
        reached = output.evaluate(loop.point.p)
        moved = float(np.max(np.abs(reached.p - point.p), initial=0.0))
        if objective_at(loop.problem, reached) <= objective_at(loop.problem, point):
            point, basis = reached, None
            if moved <= MOVED and loop.status == "converged":
                status, reason = loop.status, loop.reason
                break
        elif moved <= MOVED:
            status, reason = (
                "converged",
                "what is left to gain is below the accuracy of the reduced basis",
            )
            break
        else:
            radius = 0.25 * min(moved, radius)
    return LoopResult(
        first, point, loop.step, status, reason, tuple(history), loop.problem, loop.weight
    )


def _basis_at(model: Model, data: Sequence[FrfData], p: Array) -> Basis:
    """The basis at ``p`` for the lines and places of all recordings."""
    lines = np.concatenate([d.frequency for d in data])
    places = np.unique(np.concatenate([np.concatenate([d.responses, d.references]) for d in data]))
    shifts = (0.9 * float(lines.min()), float(np.mean(lines)), 1.05 * float(lines.max()))
    return make_basis(model, p, float(lines.max()), places, shifts)


def _better(
    output: FrfResidual, problem: StepProblem, first: FrfPoint, best: Array, p: Array
) -> Array:
    """``p`` where the output error there is below that at ``best``."""
    try:
        now = objective_at(problem, output.evaluate(p))
        known = objective_at(
            problem, first if np.array_equal(best, first.p) else output.evaluate(best)
        )
    except ModelError:
        return best
    return p if now <= known else best


def _holds(point: FrfPoint) -> bool:
    values, weights, _ = point.differences
    return bool(np.sqrt(np.mean((weights * values) ** 2)) < EXACT)


def _renumbered(history: Sequence[Iteration], done: int) -> list[Iteration]:
    return [replace(h, number=done + i + 1) for i, h in enumerate(history)]
