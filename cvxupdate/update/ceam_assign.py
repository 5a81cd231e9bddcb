"""The loop of method ``ceam``: solve, whiten the rows at the solution, solve again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg as la

from cvxupdate.convex import Bounds, LeastSquares, LinearClause, SolverChoice, StepProblem
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.residual.ceam import CeamPoint, CeamResidual
from cvxupdate.residual.ceam_modes import AssignedMode
from cvxupdate.system import Array
from cvxupdate.update.parts import equality_rows
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

SETTLED = 1e-6
"""Change of p below which whitening and expanding once more is left out."""
REPEATED = ("null-space", "dynamic", "kidder", "petersmann", "gysin")
"""Expansions that become exact as the model does, so that they are made anew at every solution."""


def assign(
    residual: CeamResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
    passes: int = 8,
) -> tuple[LoopResult[CeamPoint], int]:
    """Solve the assignment (6.13 to 6.22), whiten the rows at the solution, solve again, until p
    settles: (last loop, number of passes).

    With complete shapes and a model linear in p each pass is one convex step, exact for its
    weights; exact data need one pass only. Incomplete shapes are expanded anew in each pass, but
    only by the expansions that become exact as the model does: the others keep their bias.
    """
    if not residual.exact:
        passes = options.max_iterations if residual.expansion in REPEATED else 1
    everywhere = Options(options.tolerance, options.max_iterations, np.inf)
    loop = iterate(residual, problem, choice, everywhere, p0, progress)
    start, history = loop.start, list(loop.history)
    done = 1
    while loop.status == "converged" and done < passes and not _exactly(loop):
        residual = replace(residual, at=loop.point.p, assigned=doubted(loop.point))
        again = iterate(residual, loop.problem, choice, everywhere, loop.point.p, progress)
        history += [replace(h, number=len(history) + 1 + i) for i, h in enumerate(again.history)]
        moved = float(np.max(np.abs(again.point.p - loop.point.p), initial=0.0))
        loop, done = replace(again, weight=loop.weight), done + 1
        if moved <= SETTLED:
            break
    return refined(replace(loop, start=start, history=tuple(history))), done


def doubted(point: CeamPoint) -> tuple[AssignedMode, ...]:
    """The modes with shape deviations enlarged to the remaining misfit, where it exceeds them.

    A shape that no admissible model has would otherwise be fitted by making the model soft: the
    forces of its misfit are proportional to the stiffness. The rates keep their deviations, so that
    the frequencies decide.
    """
    values, _, _ = point.differences
    out, at = [], 0
    for mode, W in zip(point.residual.assigned, point.residual.whiteners, strict=True):
        rows = W.size * (1 if mode.real else 2)
        misfit = float(np.sqrt(np.mean(values[at : at + rows] ** 2)))
        out.append(replace(mode, std=mode.std * max(1.0, misfit)))
        at += rows
    return tuple(out)


def refined(loop: LoopResult[CeamPoint]) -> LoopResult[CeamPoint]:
    """The loop's end moved to the least-squares point on the equality clauses alone, where that
    point keeps every inequality.

    An interior-point solver stays a little inside bounds that the answer only touches (multiplier
    0: an undamped element at p = −1). There the equality-constrained solution is the answer to
    rounding; it is taken only when it breaks no clause by more than 1e-9 and lowers the objective.
    """
    problem, point = loop.problem, loop.point
    plain = (
        isinstance(problem.loss, LeastSquares)
        and not problem.regularisers
        and all(isinstance(c, LinearClause) for c in problem.clauses)
    )
    if loop.status != "converged" or not len(point.p):
        return loop
    if not plain:
        return _on_equalities(loop)
    system = point.system()
    E = equality_rows(problem, point.p)
    Z = la.null_space(E) if len(E) else np.eye(len(point.p))
    J, r = system.weighted()[0] @ Z, system.residual(point.p)
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1.0)
    move = Z @ (la.lstsq(J / size, -r, lapack_driver="gelsy", cond=1e-14)[0] / size)
    p = point.p + move
    lower, upper = next(
        (c.limits(len(p)) for c in problem.constraints if isinstance(c, Bounds)),
        (np.full(len(p), -np.inf), np.full(len(p), np.inf)),
    )
    if np.any(p < lower - 1e-9) or np.any(p > upper + 1e-9):
        return loop
    p = np.clip(p, lower, upper)
    if max((violation(c, p) for c in problem.clauses), default=0.0) > 1e-9:
        return loop
    trial = CeamPoint(point.residual, p, point.residual.model.matrices(p))
    return (
        replace(loop, point=trial)
        if objective_at(problem, trial) < objective_at(problem, point)
        else loop
    )


def _on_equalities(loop: LoopResult[CeamPoint]) -> LoopResult[CeamPoint]:
    """The end moved to the nearest point where every linear equality holds to rounding: K(p) R = 0
    to a solver's 1e-9 is a soft support, not a free motion.

    Taken only when it breaks no clause by more than the end itself did, or 1e-9.
    """
    problem, point = loop.problem, loop.point
    equal = [
        c for c in problem.clauses if isinstance(c, LinearClause) and np.all(c.lower == c.upper)
    ]
    if not equal:
        return loop
    E, right = equality_rows(problem, point.p), np.concatenate([c.upper for c in equal])
    p = point.p
    for _ in range(2):
        p = p - la.lstsq(E, E @ p - right, lapack_driver="gelsy")[0]
    before, after = (
        max((violation(c, x) for c in problem.clauses), default=0.0) for x in (point.p, p)
    )
    if after > max(before, 1e-9):
        return loop
    return replace(loop, point=CeamPoint(point.residual, p, point.residual.model.matrices(p)))


def _exactly(loop: LoopResult[CeamPoint]) -> bool:
    """Whether the equations hold so far below their deviations that weights no longer matter."""
    values, _, _ = loop.point.differences
    return loop.point.residual.exact and bool(np.sqrt(np.mean(values**2)) < 1e-4)
