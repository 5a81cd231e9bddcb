"""`run` by a classical solution of chapter 4: the equations linearised at the present parameters,
solved for all of p by name, again and again. No bounds, no clauses, no certificate: they are what
the convex step is compared with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.convex import Step, StepProblem
from cvxupdate.convex.certificate import NO_CERTIFICATE
from cvxupdate.convex.losses import LeastSquares
from cvxupdate.errors import InputError, ModelError
from cvxupdate.spec import Spec
from cvxupdate.spec.update import Update
from cvxupdate.system import Array
from cvxupdate.update.classic_curves import Curve, entropy, l_curve
from cvxupdate.update.classic_solvers import (
    Picard,
    conjugate_gradients,
    landweber,
    picard,
    svd_least_squares,
    tikhonov,
    total_least_squares,
)
from cvxupdate.update.result import ClassicalResult, clause_names
from cvxupdate.update.shortest import check_shortest
from cvxupdate.update.trial import P, Residual, objective_at
from cvxupdate.update.trust_region import Iteration, LoopResult, Options

SETTLED = 1e-6
"""Change of every parameter below which nothing moves any more."""
CHOSEN = 5
"""Linearisations at which the level or the weight is chosen anew; then it is held, because a level
that jumps to and fro lets nothing converge."""
LOST = 1e3
"""Size of p beyond which the iteration has run away."""
SWEEPS = 1000
"""Iterations of Landweber or conjugate gradients at most: without a stop they end at least
squares, the former slowly."""


@dataclass(frozen=True)
class Asked:
    """What [update] asks for: the ``solution``, its ``level`` and ``alpha`` (None: chosen)."""

    solution: str
    level: int | None
    alpha: float | None


@dataclass(frozen=True)
class Solved:
    """The solution ``p`` of one system with the ``level`` or ``alpha`` that made it, Picard's
    condition and the L-curve of that system, and how the choice was made."""

    p: Array
    level: int | None
    alpha: float | None
    picard: Picard
    curve: Curve
    says: str


def asked_of(spec: Spec, problem: StepProblem) -> Asked | None:
    """The classical solution that [update] names, None where the step is convex.

    Raises
    ------
    InputError
        Where clauses, penalties or another loss are given, or keys that the solution does not know.
    """
    u = spec.update
    if u is None or u.solution in ("convex", "minimum-norm"):
        if u is not None and u.solution == "minimum-norm":
            check_shortest(problem, spec.path)
        if u is not None and (u.level is not None or u.alpha is not None):
            raise InputError(
                f"{spec.path}: update.level and update.alpha belong to a classical solution. Name "
                "one in update.solution, or give the weight in [regularisation]."
            )
        return None
    given = [*clause_names(problem), *(f"the penalty {r.name}" for r in problem.regularisers)]
    if not isinstance(problem.loss, LeastSquares):
        given.append(f"the loss {u.loss}")
    if given:
        raise InputError(
            f"{spec.path}: update.solution = {u.solution!r} is a formula that keeps no clauses and "
            f"knows no other penalty, but the problem has {', '.join(given[:4])}. Leave them out, "
            'or take solution = "convex".'
        )
    _fitting(spec, u)
    return Asked(u.solution, u.level, u.alpha)


def _fitting(spec: Spec, u: Update) -> None:
    """InputError for a key of [update] that the solution does not know."""
    penalised = u.solution in ("tikhonov", "entropy")
    wrong = "level" if penalised and u.level is not None else ""
    wrong = "alpha" if not penalised and u.alpha is not None else wrong
    if wrong:
        other = "alpha" if penalised else "level"
        raise InputError(
            f"{spec.path}: update.{wrong} means nothing to update.solution = {u.solution!r}; "
            f"its regularisation is update.{other}."
        )
    for key, there in (
        ("starts", bool(u.starts)),
        ("begin_with", u.begin_with != "all"),
        ("release_bounds", u.release_bounds),
        ('basis = "reduced"', u.basis != "full"),
        ('reweight = "step"', u.reweight != "converged"),
        ("second_order", u.second_order),
        ('residual = "filter"', u.residual == "filter"),
    ):
        if there:
            raise InputError(
                f"{spec.path}: update.{key} is of the convex loop, not of update.solution = "
                f"{u.solution!r}. Leave one of them out."
            )


def solve_by_name(A: Array, b: Array, asked: Asked) -> Solved:
    """One weighted system A p ≈ b by the solution ``asked`` for (4.7, 4.11, 4.14–4.18, 4.23, 2.9).

    What is not given is chosen: the level of the truncation and the rank of total least squares by
    Picard's condition; α at the corner of the L-curve; the iterations of Landweber and of conjugate
    gradients where the residual has come down to the noise (Morozov), which is estimated from what
    no parameters can reach.

    Raises
    ------
    InputError
        When total least squares has no solution.
    """
    found = picard(A, b)
    name, level, alpha = asked.solution, asked.level, asked.alpha
    # Of the entropy too: near p = 0 the penalties agree, and its own curve bends a second time
    # where factors come near 0, which is no corner.
    curve = l_curve(A, b, lambda a: tikhonov(A, b, a))
    if name in ("tikhonov", "entropy"):
        says = "given" if alpha is not None else "the corner of the L-curve"
        alpha = float(curve.alpha[curve.corner]) if alpha is None else alpha
        p = tikhonov(A, b, alpha) if name == "tikhonov" else entropy(A, b, alpha)
        return Solved(p, None, alpha, found, curve, says)
    if name in ("truncated-svd", "total-least-squares"):
        says = "given" if level is not None else "Picard's condition"
        level = min(found.level if level is None else level, A.shape[1])
        if name == "truncated-svd":
            p = svd_least_squares(A, b, level)
        else:
            total = total_least_squares(A, b, rank=level)
            p, level = total.p, total.rank
        return Solved(p, level, None, found, curve, says)
    p, level, says = _iterated(A, b, asked, found)
    return Solved(p, level, None, found, curve, says)


def _iterated(A: Array, b: Array, asked: Asked, found: Picard) -> tuple[Array, int, str]:
    """The solution, its iterations, and why there were so many."""
    way = landweber if asked.solution == "landweber" else conjugate_gradients
    if asked.level is not None:
        made = way(A, b, asked.level)
        return made.p, made.iterations, "given"
    noise = found.noise * np.sqrt(len(b)) if found.noise > 0.0 else None
    made = way(A, b, SWEEPS, noise)
    says = "the residual came down to the noise"
    if noise is None:
        says = "to the end, because as many equations as parameters say nothing of the noise"
    elif made.iterations and made.residual[-1] > noise:
        says = "all that were allowed, because the residual stayed above the noise"
    return made.p, made.iterations, says


def fit_classical(
    residual: Callable[[Array], Residual[P]],
    problem: StepProblem,
    asked: Asked,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[P]:
    """p ← the solution of the equations linearised at p, until it stays: every time for all of p,
    so that what is not determined stays that of the nominal model.

    Where ``options.relative`` says so of a parameter, its equations are solved for the change Δ of
    its present factor, 1 + p ← (1 + p)(1 + Δ) (3.50, 3.51): what is not determined then stays as it
    is, and the regularisation holds each change, not their product.

    ``residual(p)`` makes the comparison whose weights belong to p. ``options.line_search`` takes
    the best of seven lengths from 1 to 2⁻⁶. The objective of the history is the squared weighted
    residual.

    Raises
    ------
    ModelError
        When the model is no structure at the start.
    """
    start = point = residual(p0).evaluate(p0)
    history: list[Iteration] = []
    held = asked
    status, reason = "stopped", f"the limit of {options.max_iterations} iterations was reached"
    solved: Solved | None = None
    says = ""
    for number in range(1, options.max_iterations + 1):
        A, b = point.system().weighted()
        factor, held_p = _factors(point.p, options)
        solved = solve_by_name(A * factor, b - A @ held_p, held)
        says = solved.says if number <= CHOSEN else says
        if number == CHOSEN:
            held = replace(asked, level=solved.level, alpha=solved.alpha)
        step = held_p + factor * solved.p - point.p
        new, length = _moved(residual, problem, point, step, options.line_search)
        if new is None or not np.all(np.abs(point.p + step) < LOST):
            reason = "the next solution is no structure: the iteration ran away"
            break
        point = new
        size = float(np.max(np.abs(length * step), initial=0.0))
        value = objective_at(problem, point)
        history.append(_line(number, value, size, point.p))
        if progress is not None:
            progress(history[-1])
        if size <= SETTLED:
            status, reason = "converged", "the solution of the next equations is the same"
            break
    last = solve_by_name(*point.system().weighted(), held) if solved is None else solved
    made = _result(asked, replace(last, says=says or last.says))
    step_made = Step(point.p, "optimal", objective_at(problem, point), NO_CERTIFICATE, "none", 0.0)
    ends = (start, point, step_made, status, reason, tuple(history))
    return LoopResult(*ends, problem, None, classical=made)


def _factors(p: Array, options: Options) -> tuple[Array, Array]:
    """What one unit of an unknown is, and the p that it is counted from: 1 and 0, of a relative
    change the present factor and the present p."""
    if not options.relative:
        return np.ones(len(p)), np.zeros(len(p))
    relative = np.array(options.relative)
    return np.where(relative, 1.0 + p, 1.0), np.where(relative, p, 0.0)


def _line(number: int, value: float, size: float, p: Array) -> Iteration:
    nothing = float("nan")  # no decrease was predicted, and there is no trust region
    return Iteration(number, value, nothing, nothing, size, True, tuple(p.tolist()))


def _moved(
    residual: Callable[[Array], Residual[P]],
    problem: StepProblem,
    point: P,
    step: Array,
    search: bool,
) -> tuple[P | None, float]:
    """The best point along the step, and its fraction of it; all of the step where nothing is
    searched. None where the model is no structure there."""
    best, least, at = None, np.inf, 1.0
    for k in range(7 if search else 1):
        p = point.p + 2.0**-k * step
        try:
            found = residual(p).evaluate(p, point)
            value = objective_at(problem, found)
        except ModelError:
            continue
        if np.isfinite(value) and value < least:
            best, least, at = found, value, 2.0**-k
    return best, at


def _result(asked: Asked, s: Solved) -> ClassicalResult:
    return ClassicalResult(
        asked.solution,
        s.level,
        s.alpha,
        s.says,
        tuple(s.picard.singular.tolist()),
        tuple(s.picard.coefficients.tolist()),
        s.picard.noise,
        s.picard.level,
        tuple(s.curve.alpha.tolist()),
        tuple(s.curve.residual.tolist()),
        tuple(s.curve.size.tolist()),
        s.curve.corner,
    )
