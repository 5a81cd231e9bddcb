"""Method ``rfm``: the response function method (thesis chapter 3) as convex steps, ended by the
output error."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse, Recording
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData, frf_data
from cvxupdate.residual.frf_points import Points, choose_points
from cvxupdate.residual.frf_reduced import ReducedResidual, make_basis
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.outcome import certificate_of, parameter_results, regularisation_of
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Metrics, Updated, clause_names
from cvxupdate.update.rfm_accuracy import accuracy_results, says
from cvxupdate.update.score import scored
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


@dataclass(frozen=True)
class Prepared:
    """What `run` fits and scores: all lines of every recording, and the chosen ones of those to
    fit."""

    fit: tuple[FrfData, ...]
    hold_out: tuple[FrfData, ...]
    chosen: tuple[FrfData, ...]
    points: tuple[Points, ...]


def prepare(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Prepared:
    """Recordings as receptances, and the lines that the [update] table asks for.

    Raises
    ------
    InputError, RecordingError
        No FRF to fit, a channel that is not on the model, a frequency outside the recording.
    """
    if spec.update is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    u = spec.update
    data = [frf_data(r, model, u.noise) for r in recordings if isinstance(r, FrequencyResponse)]
    fit = tuple(d for d in data if d.use == "fit")
    if not fit:
        raise InputError(
            'method rfm needs a recording of kind "frf" with use = "fit". Add one, or make '
            "FRFs from the time histories first."
        )
    points = tuple(choose_points(model, d, u.frequency_points, u.points) for d in fit)
    chosen = tuple(d.at(q.lines) for d, q in zip(fit, points, strict=True))
    return Prepared(fit, tuple(d for d in data if d.use != "fit"), chosen, points)


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
    """The loop over FRFs: ``kind`` one of `residual.frf.KINDS`, or "auto".

    A force balance by itself is iteratively re-weighted: the noise of the recordings enters its
    rows through Z(p), so their covariance is taken anew at each solution, until p settles.

    "auto": force balance weighted by the dynamic flexibility (exactly linear where every DOF is
    measured), the weights taken anew at its solution, then the output error from the best point so
    far; what its first part gains is kept only where the output error agrees, so the end is never
    worse than the start in the recordings' own deviations.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model as it stands.
    """
    start = model.zero() if p0 is None else p0
    if kind == "receptance":
        return iterate(
            FrfResidual(model, tuple(data), kind), problem, choice, options, start, progress
        )
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
    """One loop after another, each with the covariance of the rows at the last one's end; start and
    end are compared in the last weights."""
    history: list[Iteration] = []
    p = start
    for _ in range(REWEIGHTED):
        residual = FrfResidual(model, data, kind, p)
        loop = iterate(residual, problem, choice, options, p, progress)
        history += _renumbered(loop.history, len(history))
        moved = float(np.max(np.abs(loop.point.p - p), initial=0.0))
        p = loop.point.p
        if loop.status != "converged" or _holds(loop.point) or moved <= SETTLED:
            break
    else:
        loop = replace(
            loop,
            status="stopped",
            reason=f"the weights still changed after they were taken anew {REWEIGHTED} times",
        )
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
    lines = np.concatenate([d.frequency for d in data])
    places = np.unique(np.concatenate([np.concatenate([d.responses, d.references]) for d in data]))
    shifts = (0.9 * float(lines.min()), float(np.mean(lines)), 1.05 * float(lines.max()))
    history: list[Iteration] = []
    radius, basis = min(options.radius, NEAR_RADIUS), None
    status, reason = "stopped", f"the parameters still moved after {REFRESHES} bases"
    for _ in range(REFRESHES):
        basis = (
            make_basis(model, point.p, float(lines.max()), places, shifts)
            if basis is None
            else basis
        )
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


def update_rfm(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[Iteration], None] | None = None,
) -> Updated:
    """Update ``model`` on measured frequency responses.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    begin = time.perf_counter()
    prepared = prepare(spec, model, recordings)
    problem, choice = step_problem(spec, model, recordings), solver_choice(spec)
    kind = spec.update.residual if spec.update is not None else "auto"
    reduced = spec.update is not None and spec.update.basis == "reduced"
    if reduced:
        loop = fit_reduced(
            model, prepared.chosen, problem, choice, loop_options(spec, model), None, progress
        )
    else:
        loop = fit_responses(
            model, prepared.chosen, problem, choice, loop_options(spec, model), kind, None, progress
        )
    end = loop.point
    relative = all(d.relative_only for d in prepared.chosen)
    known = uncertainty(
        end.system(), end.p, model.parameters, equality_rows(loop.problem, end.p), relative
    )
    infeasible = loop.status == "infeasible"
    notes = [w for q in prepared.points for w in q.warnings]
    notes += [_chosen(d, q) for d, q in zip(prepared.chosen, prepared.points, strict=True)]
    accurate = accuracy_results(model, prepared.fit, prepared.points)
    if spec.update is not None and spec.update.frequency_points == "log-function":
        notes += [says(a) for a in accurate]
    if relative:
        notes.append(
            "The recordings state no deviations: their weights are relative, and the "
            "parameters' deviations come from the scatter of the residual."
        )
    elif known.noise > 2.0:
        notes.append(
            f"The residual is {known.noise:.1f} times what the stated deviations allow: what "
            "remains is not of the parameters' kind. The model lacks something else (mesh, "
            "joints, damping, other parameters); the parameters' deviations were enlarged by "
            "that factor."
        )
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=str(spec.path),
        status=loop.status,
        reason=loop.reason,
        method="rfm",
        solver=loop.step.solver,
        iterations=len(loop.history),
        parameters=parameter_results(model, end.p, known, relative, len(loop.history) > 0),
        fit=metrics(model, recordings, loop),
        certificate=certificate_of(loop),
        time=time.perf_counter() - begin,
        conflict=loop.step.conflict if infeasible else (),
        relaxation=tuple(r.says for r in loop.step.relaxation) if infeasible else (),
        history=tuple(asdict(h) for h in loop.history),
        undetermined=tuple(
            {
                "coefficients": dict(c.coefficients),
                "standard_deviation": float(c.std) if np.isfinite(c.std) else None,
                "says": c.says,
            }
            for c in known.undetermined
        ),
        noise=None if relative else known.noise,
        active=loop.step.active,
        regularisation=regularisation_of(loop),
        model={
            "clauses": clause_names(loop.problem),
            "dofs": model.size,
            "elements": int(sum(len(set(b.ids.tolist())) for b in model.blocks)),
            "nodes": len(model.node_ids),
            "mass_before": model.total_mass(),
            "mass_after": model.total_mass(end.p),
        },
        notes=tuple(notes),
        accuracy=accurate,
    )


def metrics(
    model: Model, recordings: Sequence[Recording], loop: LoopResult[FrfPoint]
) -> dict[str, Metrics]:
    """The contract's metrics: the response errors over every line of the recordings, not only the
    chosen ones, and the objective."""
    out: dict[str, Metrics] = {"fit": {}, "hold_out": {}}
    if not any(isinstance(r.weight, str) for r in loop.problem.regularisers):
        out["fit"]["objective"] = {
            "before": objective_at(loop.problem, loop.start),
            "after": objective_at(loop.problem, loop.point),
        }
    return scored(out, model, loop.point.p, recordings)


def _chosen(data: FrfData, points: Points) -> str:
    f = data.frequency
    first = f"{points.held[0]:.5g} Hz" if len(points.held) else "none below the last line"
    return (
        f"{data.name}: {len(f)} lines from {f.min():.5g} to {f.max():.5g} Hz, {points.modes} "
        "modes of the model among them; first frequency of the structure held at its "
        f"sensors: {first}."
    )
