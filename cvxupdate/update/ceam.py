"""Method ``ceam``: constrained eigenstructure assignment (thesis chapter 6) as a convex program."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

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
from cvxupdate.update.ceam_assign import assign
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.invisible import invisible
from cvxupdate.update.measured_modes import modal_metrics, modal_tables, mode_results
from cvxupdate.update.outcome import RELATIVE, objective_metric, updated
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Metrics, ModeResult, Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.trust_region import Iteration, LoopResult

MODAL_EXPANSIONS = ("serep", "serepa", "tam", "hybrid")


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
    residual = residual_of(spec, model, recordings)
    fit, hold_out = modal_tables(recordings)
    staged = _in_stages(spec, model, fit, residual, progress)
    loop, residual = staged.loop, staged.residual
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
    scores.fit["fit"] |= objective_metric(
        loop, residual.evaluate(model.zero()), residual.evaluate(end.p)
    )
    fitted = scores.fit
    if scores.modes:
        fitted = with_responses(fitted, model, end.p, recordings)
    return updated(
        spec,
        model,
        loop,
        known,
        relative,
        begin,
        method="ceam",
        fit=fitted,
        notes=(*staged.notes, *scores.notes, *_notes(residual, staged.passes, relative)),
        modes=scores.modes,
        facts=staged.facts,
    )


@dataclass(frozen=True)
class Staged:
    """The end of one or two stages: the last ``loop`` with the history of all, the ``residual`` it
    began from, the ``passes`` of its whitening."""

    loop: LoopResult[CeamPoint]
    residual: CeamResidual
    passes: int
    notes: tuple[str, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict)


def _in_stages(
    spec: Spec,
    model: Model,
    fit: Sequence[ModeTable],
    residual: CeamResidual,
    progress: Callable[[Iteration], None] | None,
) -> Staged:
    """The assignment, with the model's own shapes first where two stages are asked for."""
    problem, choice, options = (
        step_problem(spec, model, fit),
        solver_choice(spec),
        loop_options(spec, model),
    )
    p0 = model.zero()
    if spec.update is None or spec.update.stages != 2:
        loop, passes = assign(residual, problem, choice, options, p0, progress)
        return Staged(loop, residual, passes)
    first, _ = assign(
        replace(residual, assigned=_first_stage(spec, model, fit, residual.assigned)),
        problem,
        choice,
        options,
        p0,
        progress,
    )
    notes: tuple[str, ...] = ()
    facts: dict[str, Any] = {}
    if first.status != "infeasible":
        p0 = first.point.p
        notes = (
            "Two stages: first the measured eigenvalues with the model's own shapes, "
            "then eigenvalues and shapes.",
        )
        facts = {"first_stage": p0.tolist()}
        residual = replace(residual, at=p0)
    loop, passes = assign(residual, problem, choice, options, p0, progress)
    done = len(first.history)
    later = (replace(h, number=done + i + 1) for i, h in enumerate(loop.history))
    return Staged(replace(loop, history=(*first.history, *later)), residual, passes, notes, facts)


@dataclass(frozen=True)
class Scores:
    """Metrics and modes of the updated model; none of them where its matrices are no structure."""

    fit: dict[str, Metrics]
    modes: tuple[ModeResult, ...] = ()
    notes: tuple[str, ...] = ()


def scores_of(
    spec: Spec, model: Model, fit: Sequence[ModeTable], hold_out: Sequence[ModeTable], p: Array
) -> Scores:
    """Metrics and modes of ``model`` at 0 and at ``p`` (n,)."""
    pairing = spec.update.pairing if spec.update is not None else "auto"
    scored = modal_residual(model, fit, hold_out, True, pairing)
    before = scored.evaluate(model.zero())
    try:
        after = scored.evaluate(p, before)
    except ModelError as error:  # the modes are assigned all the same; the result says what it is
        note = (
            f"The updated matrices are no structure: {error} The clauses mass_positive and "
            "stiffness_positive keep them one."
        )
        return Scores({"fit": {}, "hold_out": {}}, notes=(note,))
    return Scores(modal_metrics(before, after), mode_results(before, after))


def _notes(residual: CeamResidual, passes: int, relative: bool) -> tuple[str, ...]:
    notes = []
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
        notes.append(RELATIVE)
    return tuple(notes)


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
    own = [m for m in assigned if ": own mode " in m.label]
    kind = damping_kind(model)
    return (*with_own_shapes(model, start.modes, measured, places, kind), *own)
