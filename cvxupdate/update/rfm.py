"""Method ``rfm``: the response function method (thesis chapter 3) as convex steps, ended by the
output error."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse, Recording
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData, frf_data
from cvxupdate.residual.frf_points import Points, choose_points
from cvxupdate.spec import Spec
from cvxupdate.update.classical import asked_of, fit_classical
from cvxupdate.update.covariance import Uncertainty, uncertainty
from cvxupdate.update.invisible import invisible
from cvxupdate.update.judgement import correlation_of
from cvxupdate.update.outcome import (
    certificate_of,
    family_results,
    model_facts,
    outside,
    parameter_results,
    regularisation_of,
    solver_of,
    told_of,
    undetermined_of,
)
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import AccuracyResult, Metrics, Updated, clause_names
from cvxupdate.update.rfm_accuracy import accuracy_results, says
from cvxupdate.update.rfm_band import fit_growing
from cvxupdate.update.rfm_loop import fit_reduced, fit_responses
from cvxupdate.update.rfm_steps import FIRST_RADIUS, fit_stepwise
from cvxupdate.update.score import scored
from cvxupdate.update.trust_region import Iteration, LoopResult, objective_at


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
    loop = fit_loop(spec, model, recordings, prepared, progress)
    end = loop.point
    relative = all(d.relative_only for d in prepared.chosen)
    known = uncertainty(
        end.system(),
        end.p,
        model.parameters,
        equality_rows(loop.problem, end.p),
        relative,
        invisible(model, end.p),
    )
    infeasible = loop.status == "infeasible"
    accurate = accuracy_results(model, prepared.fit, prepared.points)
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=spec.shown,
        status=loop.status,
        reason=loop.reason,
        method="rfm",
        solver=solver_of(loop),
        iterations=len(loop.history),
        parameters=parameter_results(model, loop, known),
        fit=metrics(model, recordings, loop),
        certificate=certificate_of(loop),
        time=time.perf_counter() - begin,
        conflict=loop.step.conflict if infeasible else (),
        relaxation=tuple(r.says for r in loop.step.relaxation) if infeasible else (),
        history=tuple(asdict(h) for h in loop.history),
        undetermined=undetermined_of(known, loop),
        told=told_of(known),
        noise=None if relative else known.noise,
        active=loop.step.active,
        regularisation=regularisation_of(loop),
        model={
            "clauses": clause_names(loop.problem),
            **model_facts(model, end.p),
        },
        notes=(*_notes(spec, prepared, accurate, relative, known), *outside(model, loop)),
        accuracy=accurate,
        families=family_results(model, end.p),
        classical=loop.classical,
        correlations=None if infeasible else correlation_of(known, model.parameters),
    )


def fit_loop(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    prepared: Prepared,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[FrfPoint]:
    """The loop that the [update] table asks for, over the chosen lines.

    Raises
    ------
    InputError, ModelError
        What the table names cannot be used.
    """
    problem, choice = step_problem(spec, model, recordings), solver_choice(spec)
    options = loop_options(spec, model)
    asked = asked_of(spec, problem)
    if asked is not None:
        kind = spec.update.residual if spec.update is not None else "auto"
        kind = "flexibility" if kind == "auto" else kind
        return fit_classical(
            lambda p: FrfResidual(model, prepared.chosen, kind, p),
            problem,
            asked,
            options,
            model.zero(),
            progress,
        )
    if spec.update is not None and spec.update.basis == "reduced":
        return fit_reduced(model, prepared.chosen, problem, choice, options, None, progress)
    kind = spec.update.residual if spec.update is not None else "auto"
    if spec.update is not None and spec.update.reweight == "step":
        if kind != "flexibility":
            raise InputError(
                f'{spec.path}: update.reweight = "step" is of residual = "flexibility" only. Set '
                "that residual, or leave reweight out."
            )
        if spec.update.trust_radius is None:
            options = replace(options, radius=FIRST_RADIUS)
        low = spec.update.begin_with == "low"
        return fit_stepwise(
            model, prepared.chosen, problem, choice, options, low, progress=progress
        )
    if spec.update is not None and spec.update.begin_with == "low":
        return fit_growing(model, prepared.chosen, problem, choice, options, kind, progress)
    return fit_responses(model, prepared.chosen, problem, choice, options, kind, None, progress)


def _notes(
    spec: Spec,
    prepared: Prepared,
    accurate: Sequence[AccuracyResult],
    relative: bool,
    known: Uncertainty,
) -> tuple[str, ...]:
    """What is to be said of the lines, the accuracy needed, and the noise."""
    notes = [w for q in prepared.points for w in q.warnings]
    notes += [_chosen(d, q) for d, q in zip(prepared.chosen, prepared.points, strict=True)]
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
    return tuple(notes)


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
        "modes in the range of the recording; first frequency of the structure held at its "
        f"sensors: {first}."
    )
