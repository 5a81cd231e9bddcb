"""Method ``ceam``: constrained eigenstructure assignment (thesis chapter 6) as a convex program."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
import scipy.linalg as la

from cvxupdate.convex import Bounds, LeastSquares, LinearClause, SolverChoice, StepProblem
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.ceam import CeamPoint, CeamResidual
from cvxupdate.residual.ceam_modes import (
    AssignedMode,
    assigned_modes,
    damping_kind,
    self_assigned,
    with_own_shapes,
)
from cvxupdate.residual.modal import modal_residual
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.modal import (
    certificate_of,
    modal_metrics,
    modal_tables,
    mode_results,
    parameter_results,
    regularisation_of,
)
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Metrics, ModeResult, Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

SETTLED = 1e-6
"""Change of p below which whitening and expanding once more is left out."""
MODAL_EXPANSIONS = ("serep", "serepa", "tam", "hybrid")
REPEATED = ("null-space", "dynamic", "gysin")
"""Expansions that become exact as the model does, so that they are made anew at every solution."""


def residual_of(
    spec: Spec, model: Model, recordings: Sequence[Recording], at: Array | None = None
) -> CeamResidual:
    """The assignment that the [update] table asks for, whitened at ``at`` (None: the model as it
    stands).

    Raises
    ------
    InputError, RecordingError
        No shapes, a channel that is not on the model, more own modes asked for than the model has.
    """
    if spec.update is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    fit, _ = modal_tables(recordings)
    kind = damping_kind(model)
    measured = assigned_modes(model, fit, kind)
    own = spec.update.self_assign
    # SEREPa takes as many modes as masters by definition; more modes than were measured make the
    # others ill-conditioned.
    basis = (
        max(len(mode.at) for mode in measured)
        if spec.update.expansion == "serepa"
        else len(measured) + 4
    )
    modes = (
        model_modes(model, min(max(basis, len(measured) + own + 6), model.size))
        if own or spec.update.expansion in MODAL_EXPANSIONS
        else None
    )
    assigned = measured
    if own and modes is not None:
        first = 1 + max(_partners(spec, model, fit), default=0)
        last = len(modes.eigenvalues) - modes.rigid
        if first + own > last:
            raise InputError(
                f"{spec.path}: update.self_assign = {own}, but above the measured modes the "
                f"model has only {max(0, last - first)}. Ask for fewer."
            )
        assigned += self_assigned(model, modes, range(first, first + own))
    few = (
        None
        if modes is None
        else Modes(
            modes.eigenvalues[: modes.rigid + basis],
            modes.shapes[:, : modes.rigid + basis],
            modes.rigid,
        )
    )
    by_norm = spec.update.loss in ("least-squares", "norm")
    return CeamResidual(
        model, assigned, spec.update.expansion, model.zero() if at is None else at, few, by_norm
    )


def _partners(spec: Spec, model: Model, fit: Sequence[ModeTable]) -> list[int]:
    """Flexible mode numbers (from 0) of the model that the measured modes are paired with."""
    pairing = spec.update.pairing if spec.update is not None else "auto"
    start = modal_residual(model, fit, (), False, pairing).start
    return [int(i) - start.modes.rigid for places in start.places for i in places if i >= 0]


def assign(
    residual: CeamResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
    passes: int = 8,
) -> tuple[LoopResult[CeamPoint], int]:
    """Solve, whiten the rows at the solution, solve again, until p settles: (last loop, number of
    passes).

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
    """The modes with shape deviations enlarged to the misfit that was left, where it exceeds them.

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


def update_ceam(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[Iteration], None] | None = None,
) -> Updated:
    """Update ``model`` by assigning measured modes.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    begin = time.perf_counter()
    if spec.update is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    fit, hold_out = modal_tables(recordings)
    residual = residual_of(spec, model, recordings)
    problem, choice, options = (
        step_problem(spec, model),
        solver_choice(spec),
        loop_options(spec, model),
    )
    notes: list[str] = []
    p0, between = model.zero(), {}
    history: tuple[Iteration, ...] = ()
    if spec.update.stages == 2:
        first, _ = assign(
            replace(residual, assigned=_first_stage(spec, model, fit, residual.assigned)),
            problem,
            choice,
            options,
            p0,
            progress,
        )
        history = first.history
        if first.status != "infeasible":
            p0 = first.point.p
            notes.append(
                "Two stages: first the measured eigenvalues with the model's own shapes, "
                "then eigenvalues and shapes."
            )
            residual = replace(residual, at=p0)
            between = {"first_stage": p0.tolist()}
    loop, passes = assign(residual, problem, choice, options, p0, progress)
    loop = replace(
        loop,
        history=(
            *history,
            *(replace(h, number=len(history) + i + 1) for i, h in enumerate(loop.history)),
        ),
    )
    start, end = loop.start, loop.point
    relative = all(t.relative_only for t in fit) and all(t.shape_std is None for t in fit)
    known = uncertainty(
        end.system(), end.p, model.parameters, equality_rows(loop.problem, end.p), relative
    )
    scored = modal_residual(model, fit, hold_out, True, spec.update.pairing)
    before = scored.evaluate(model.zero())
    try:
        after = scored.evaluate(end.p, before)
    except (
        ModelError
    ) as error:  # the modes are assigned all the same; the result says that this is no structure
        notes.append(
            f"The updated matrices are no structure: {error} The clauses mass_positive and "
            "stiffness_positive keep them one."
        )
        fitted: dict[str, Metrics] = {"fit": {}, "hold_out": {}}
        modes: tuple[ModeResult, ...] = ()
    else:
        fitted, modes = modal_metrics(before, after, None), mode_results(before, after)
    if not any(isinstance(r.weight, str) for r in loop.problem.regularisers):
        fitted["fit"]["objective"] = {
            "before": objective_at(loop.problem, residual.evaluate(model.zero())),
            "after": objective_at(loop.problem, residual.evaluate(end.p)),
        }
    if modes:
        fitted = with_responses(fitted, model, end.p, recordings)
    if passes > 1:
        notes.append(
            f"The rows were whitened{'' if residual.exact else ' and the shapes expanded'} "
            f"anew at the solution, {passes} passes in all."
        )
    if not residual.exact:
        notes.append(
            f"Some DOFs were not measured and were expanded ({residual.expansion}): the "
            "equations are linear in the parameters only locally, and so is what the step "
            "proves."
        )
    if relative:
        notes.append(
            "The recordings state no deviations: their weights are relative, and the "
            "parameters' deviations come from the scatter of the residual."
        )
    del start
    infeasible = loop.status == "infeasible"
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=str(spec.path),
        status=loop.status,
        reason=loop.reason,
        method="ceam",
        solver=loop.step.solver,
        iterations=len(loop.history),
        parameters=parameter_results(model, end.p, known, relative, len(loop.history) > 0),
        fit=fitted,
        certificate=certificate_of(loop),
        time=time.perf_counter() - begin,
        conflict=loop.step.conflict if infeasible else (),
        relaxation=tuple(r.says for r in loop.step.relaxation) if infeasible else (),
        modes=modes,
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
            "dofs": model.size,
            "elements": int(
                sum(len(set(b.ids.tolist())) for b in model.blocks if b.kind.name != "entry")
            ),
            "nodes": len(model.node_ids),
            "mass_before": model.total_mass(),
            "mass_after": model.total_mass(end.p),
            **between,
        },
        notes=tuple(notes),
    )


def _first_stage(
    spec: Spec, model: Model, fit: Sequence[ModeTable], assigned: Sequence[AssignedMode]
) -> tuple[AssignedMode, ...]:
    """Measured eigenvalues with the model's shapes, and the self-assigned modes as they are."""
    pairing = spec.update.pairing if spec.update is not None else "auto"
    start = modal_residual(model, fit, (), False, pairing).start
    places = [
        int(i)
        for table, at in zip(fit, start.places, strict=True)
        if table.shapes is not None
        for i in at
    ]
    measured = [m for m in assigned if ": own mode " not in m.label]
    if len(places) != len(measured):
        raise InputError(
            f"{spec.path}: update.stages = 2 needs a shape for every measured mode. Leave out "
            "the modes without one."
        )
    return with_own_shapes(model, start.modes, measured, places, damping_kind(model))
