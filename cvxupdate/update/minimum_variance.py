"""Method ``minimum-variance`` (2.8.2): the best linear unbiased estimate from measurements and
model, both uncertain, renewed at every iteration.

An estimate p_j of covariance V_j that came from the measurements is correlated with them. Collins
and Young (1972) take both for independent at every iteration, so V_j ← (V_j⁻¹ + SᵀS)⁻¹ about p_j:
after k iterations the same measurements have been counted k times. Friswell (1989) carries the
covariance D_j of p_j's error with the measurements': where S stays, his gain
(V_j Sᵀ − D_j)(S V_j Sᵀ − S D_j − D_jᵀ Sᵀ + 1)⁻¹ is 0 from the second iteration on. Where S changes
to S′ that gain grows like (S′ − S)⁻¹, because V_j and D_j still hold for the old S. Here both are
taken at the present S: V_j = (V_0⁻¹ + SᵀS)⁻¹, D_j = V_j Sᵀ, so that p_j says nothing by itself, and
each step is the estimate from the nominal model and the measurements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg as la

from cvxupdate.convex import LinearClause, Prior, SolverChoice, StepProblem
from cvxupdate.convex.constraints.clauses import is_active, stack
from cvxupdate.errors import InputError
from cvxupdate.residual.modal import ModalPoint, ModalResidual
from cvxupdate.system import Array
from cvxupdate.update.parts import equality_rows
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate

ON_CLAUSE = 1e-6  # of a clause's own scale: it held the step


def gain(V: Array, S: Array, held: Array) -> Array:
    """T (n, m): the least-variance step from an estimate of covariance V (n, n) is T (measured −
    model) for derivatives S (m, n) in the measurements' deviations, nothing moving along the rows
    ``held`` (k, n)."""
    Z = la.null_space(held) if len(held) else np.eye(len(V))
    B = S @ Z
    precision = Z.T @ la.solve(V, Z, assume_a="pos")
    return np.asarray(Z @ la.solve(precision + B.T @ B, B.T, assume_a="pos"))


def posterior(V: Array, S: Array, T: Array) -> Array:
    """The covariance (n, n) after a step T (n, m) from an estimate of covariance V, independent of
    the measurements; for any T (Joseph's form)."""
    kept = np.eye(len(V)) - T @ S
    out = kept @ V @ kept.T + T @ T.T
    return np.asarray((out + out.T) / 2.0)


def within(V: Array, rows: Array) -> Array:
    """The covariance of parameters that satisfy ``rows`` (k, n) exactly."""
    if not len(rows):
        return V
    Z = la.null_space(rows)
    inside = la.inv(Z.T @ la.solve(V, Z, assume_a="pos"))
    return np.asarray(Z @ inside @ Z.T)


def counted_again(here: ModalPoint, problem: StepProblem, moved: ModalPoint) -> StepProblem:
    """Collins's form: after the step from ``here`` to ``moved`` its result is what is known before
    the next one (``renew`` of `update.trust_region.iterate`)."""
    V = _prior(problem).matrix
    values, weights, _ = here.differences
    S = here.system().weighted()[0]
    clauses = [c for c in problem.clauses if isinstance(c, LinearClause)]
    held = stack([c for c in clauses if is_active(c, moved.p, ON_CLAUSE)], len(V)).C.toarray()
    T = gain(V, S, held)
    full = -T @ (weights * values)
    size = float(full @ full)
    # a step that was cut short used its part of the measurements
    part = np.clip(float((moved.p - here.p) @ full) / size, 0.0, 1.0) if size > 0.0 else 1.0
    return _with_prior(problem, posterior(V, S, part * T), "present")


def minimum_variance(
    residual: ModalResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    correlated: bool,
    progress: Callable[[Iteration], None] | None = None,
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
    """The loop from ``p0`` (2.8.2), with the covariance of where it ends, and notes. The covariance
    before is that of the problem's penalty `prior`; ``correlated`` as Friswell, else as Collins.

    Raises
    ------
    InputError
        Without such a penalty.
    """
    prior = _prior(problem)
    V = prior.matrix / float(prior.weight)
    if correlated:
        begun = _with_prior(problem, V, "nominal")
        loop = iterate(residual, begun, choice, options, p0, progress)
        S = loop.point.system().weighted()[0]
        V = posterior(V, S, gain(V, S, np.zeros((0, len(V)))))
        notes: tuple[str, ...] = ()
    else:
        begun = _with_prior(problem, V, "present")
        loop = iterate(residual, begun, choice, options, p0, progress, counted_again)
        V = _prior(loop.problem).matrix
        notes = (
            "Estimates and measurements were taken for independent. They are in the first "
            f"iteration only: {sum(h.accepted for h in loop.history)} iterations counted the "
            "measurements as often, so the stated deviations are too small.",
        )
    V = within(V, equality_rows(loop.problem, loop.point.p))
    return replace(loop, covariance=V), notes


def _prior(problem: StepProblem) -> Prior:
    """The one prior of the problem.

    Raises
    ------
    InputError
        Where there is none, several, or one without weight.
    """
    priors = [r for r in problem.regularisers if isinstance(r, Prior)]
    if len(priors) != 1 or isinstance(priors[0].weight, str) or not priors[0].weight:
        raise InputError(
            "minimum-variance needs the deviations of the parameters before the update: one "
            'kind = "prior" in [regularisation], with `deviation`, `deviations` or `covariance`, '
            "its weight a number above 0."
        )
    return priors[0]


def _with_prior(problem: StepProblem, V: Array, about: str) -> StepProblem:
    """The problem with the prior V (n, n) in place of its own."""
    others = tuple(r for r in problem.regularisers if not isinstance(r, Prior))
    return replace(problem, regularisers=(Prior(1.0, V, about), *others))
