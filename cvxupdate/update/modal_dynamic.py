"""Method ``modal-dynamic``: the modal dynamic residual of measured modes by convex steps, and how
far its minimum may be from the global one."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cvxupdate.convex import LeastSquares, SolverChoice, StepProblem
from cvxupdate.convex.lower_bound import NOTHING, GlobalBound, global_bound, too_large
from cvxupdate.convex.moments import Term, term
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.residual.ceam_modes import impedance
from cvxupdate.residual.modal_dynamic import (
    DynamicPoint,
    DynamicResidual,
    dynamic_residual,
)
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.ceam import scores_of
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.invisible import invisible
from cvxupdate.update.measured_modes import modal_tables
from cvxupdate.update.outcome import RELATIVE, objective_metric, updated
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate

PASSES = 30  # how often the weights are taken anew at the solution, at most
SETTLED = 1e-6  # change of p below which they are not
LINEAR = 1e-10  # relative deviation from linearity that is rounding
COMPLETE = (
    "Every shape was measured at every DOF, so the residual is linear in the parameters: with "
    "these weights the minimum is the global one, as the certificate of the step says."
)
TIGHT = 1e3
"""Of the least deviation of a row: rows that the measured deviations move by no more are as good as
equations beside the others, whose deviations are of the order of 1e6."""
LARGEST_SHAPE = 5.0
"""Unmeasured entries up to this many times the largest measured one are looked into by the bound
(the range of the published comparison of problems/real/smu-modal-data)."""


def update_modal_dynamic(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[Iteration], None] | None = None,
) -> Updated:
    """Update ``model`` so that the measured modes need the least forces beside their own.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    begin = time.perf_counter()
    fit, hold_out = modal_tables(recordings)
    residual = dynamic_residual(model, fit, model.zero())
    problem, choice = step_problem(spec, model, recordings), solver_choice(spec)
    way = Way(problem, choice, loop_options(spec, model), progress)
    loop, passes = settled(way, residual, model.zero())
    judged = judge(way, loop)
    if judged.elsewhere is not None:
        other, more = settled(way, loop.point.residual, judged.elsewhere)
        history = (*loop.history, *other.history)
        loop, passes = replace(other, start=loop.start, history=history), passes + more
        judged = judge(way, loop)
    end = loop.point
    relative = all(t.relative_only for t in fit) and all(t.shape_std is None for t in fit)
    known = uncertainty(
        end.system(),
        end.p,
        model.parameters,
        equality_rows(loop.problem, end.p),
        relative,
        invisible(model, end.p),
    )
    scores = scores_of(spec, model, fit, hold_out, end.p)
    metrics = scores.fit
    metrics["fit"] |= objective_metric(
        loop, end.residual.evaluate(model.zero()), end.residual.evaluate(end.p)
    )
    if scores.modes:
        metrics = with_responses(metrics, model, end.p, recordings)
    weighed = f"The rows were weighted anew at the solution, {passes} passes in all."
    notes = (*scores.notes, *((weighed,) if passes > 1 else ()), judged.says)
    found = updated(
        spec,
        model,
        loop,
        known,
        relative,
        begin,
        method="modal-dynamic",
        fit=metrics,
        notes=(*notes, *((RELATIVE,) if relative else ())),
        modes=scores.modes,
    )
    return replace(found, certificate={**found.certificate, "global": judged.as_dict()})


@dataclass(frozen=True)
class Way:
    """How the loop goes."""

    problem: StepProblem
    choice: SolverChoice
    options: Options
    progress: Callable[[Iteration], None] | None = None


def settled(way: Way, residual: DynamicResidual, p0: Array) -> tuple[LoopResult[DynamicPoint], int]:
    """The loop from ``p0`` (n,), again with the weights of its end until that stays where it is:
    (last loop with the whole history, passes)."""
    loop = iterate(residual, way.problem, way.choice, way.options, p0, way.progress)
    start, history, passes = loop.start, list(loop.history), 1
    while loop.status == "converged" and passes < PASSES:
        p = loop.point.p
        there = replace(residual, at=p)
        again = iterate(there, loop.problem, way.choice, way.options, p, way.progress)
        history += [replace(h, number=len(history) + 1 + i) for i, h in enumerate(again.history)]
        loop, passes = replace(again, weight=loop.weight), passes + 1
        if float(np.max(np.abs(again.point.p - p), initial=0.0)) <= SETTLED:
            break
    return replace(loop, start=start, history=tuple(history)), passes


@dataclass(frozen=True)
class Judged:
    """What is known of the global minimum: the ``bound`` (None: none, ``says`` why), whether the
    end is it (None: not known), and a point ``elsewhere`` (n,) that is lower than the loop's end by
    more than the bound's accuracy."""

    bound: GlobalBound | None
    says: str
    optimal: bool | None = None
    elsewhere: Array | None = None

    def as_dict(self) -> dict[str, Any]:
        """For result.json."""
        out: dict[str, Any] = {"says": self.says, "optimal": self.optimal}
        if self.bound is not None:
            b = self.bound
            out |= {
                "objective": b.best,
                "lower_bound": b.lower,
                "gap": b.gap,
                "relative_gap": b.relative,
                "boxes": b.boxes,
            }
        return out


def judge(way: Way, loop: LoopResult[DynamicPoint]) -> Judged:
    """The convex lower bound of the objective at the loop's end, over the bounds of the parameters,
    with the weights of the end.

    Clauses other than bounds are left out of it: fewer constraints, a lower bound all the same.
    """
    point, model = loop.point, loop.point.residual.model
    if loop.status == "converged" and point.residual.complete and linear(model):
        return Judged(None, COMPLETE, True)
    why = _unbounded(way, loop)
    if why:
        return Judged(None, f"No lower bound of the objective was computed: {why}.")
    lower = np.array([q.lower for q in model.parameters])
    upper = np.array([q.upper for q in model.parameters])
    residual = point.residual
    order = too_large(len(lower), [len(residual.unmeasured(mode)) for mode in residual.assigned])
    if order is not None:
        return Judged(
            None,
            "No lower bound of the objective was computed, so whether this is the global minimum "
            f"is not known: its semidefinite program is of order {order}, (1 + parameters) × (1 + "
            "unmeasured DOFs). Fewer parameters or more sensors make it smaller.",
        )

    def value(p: Array) -> float:
        return float(np.sum(residual.evaluate(p).differences[0] ** 2))

    here = value(point.p)
    bound = global_bound(bilinear_terms(residual), lower, upper, point.p, value)
    better = bound.best < here * (1.0 - 1e-3)
    return Judged(bound, _says(bound), bound.optimal, bound.p if better else None)


def _says(bound: GlobalBound) -> str:
    where = (
        "within the bounds of the parameters, for shapes whose unmeasured entries are up to "
        f"{LARGEST_SHAPE:g} times the largest measured one and with the weights of this solution"
    )
    figures = f"lower bound {bound.lower:.6g}, objective {bound.best:.6g}"
    if bound.best <= NOTHING:
        return (
            f"Globally optimal: the objective, {bound.best:.1e}, is rounding, and none is below 0."
        )
    if bound.optimal:
        return f"Globally optimal to {bound.relative:.1e} of the objective ({figures}) {where}."
    return (
        f"Not proved to be the global minimum: {figures}, a gap of {100 * bound.relative:.2g} % "
        f"after {bound.boxes} convex programs, {where}."
    )


def _unbounded(way: Way, loop: LoopResult[DynamicPoint]) -> str:
    """Why there is no bound; empty where there can be one."""
    model = loop.point.residual.model
    if loop.status == "infeasible":
        return "the step is infeasible"
    if not isinstance(way.problem.loss, LeastSquares) or way.problem.regularisers:
        return "it is that of least squares without a penalty"
    free = [q.name for q in model.parameters if not np.isfinite(q.upper - q.lower)]
    if free:
        return f"{', '.join(free[:5])} has no bounds"
    if not linear(model):
        return "K and M are not linear in the parameters"
    return ""


def linear(model: Model) -> bool:
    """Whether K and M are linear in p: compared at a point between the bounds."""
    p = np.array([q.lower + 0.37 * (q.upper - q.lower) for q in model.parameters])
    zero, there = model.matrices(model.zero()), model.matrices(p)
    units = [model.matrices(e) for e in np.eye(len(p))]
    for name in ("K", "M"):
        base, end = getattr(zero, name), getattr(there, name)
        foretold = base + sum(
            (value * (getattr(u, name) - base) for value, u in zip(p, units, strict=True)),
            start=0.0 * base,
        )
        if abs(end - foretold).max() > LINEAR * abs(base).max():
            return False
    return True


def bilinear_terms(residual: DynamicResidual) -> tuple[Term, ...]:
    """The weighted forces of every mode as they depend on p and on its unmeasured entries."""
    model = residual.model
    zero = model.matrices(model.zero())
    units = [model.matrices(e) for e in np.eye(len(model.parameters))]
    out = []
    for k, mode in enumerate(residual.assigned):
        rows, deviations = residual.principal(k)
        W = rows / deviations[:, None]
        rest = residual.unmeasured(mode)
        Z = impedance(zero, mode).toarray()
        changes = np.array([W @ (impedance(u, mode).toarray() - Z) for u in units])
        base = W @ Z
        out.append(
            term(
                base[:, mode.at] @ mode.shape,
                (changes[:, :, mode.at] @ mode.shape).T,
                base[:, rest],
                changes[:, :, rest],
                np.full(len(rest), LARGEST_SHAPE * float(np.abs(mode.shape).max())),
                deviations < TIGHT,
            )
        )
    return tuple(out)
