"""Methods ``frequencies`` and ``sensitivity``: penalty-function updating on modal data (thesis
2.8.1) as convex steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.another_pairing import another_pairing
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.residual.shape_rows import Index
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.covariance import Uncertainty, uncertainty
from cvxupdate.update.measured_modes import modal_metrics, modal_tables, mode_results
from cvxupdate.update.outcome import RELATIVE, objective_metric, updated
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

REPAIRINGS = 5  # how often the loop may go on with another pairing


def residual_of(spec: Spec, model: Model, recordings: Sequence[Recording]) -> ModalResidual:
    """The modal comparison that the [update] table asks for."""
    if spec.update is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    return _comparison(spec, model, *modal_tables(recordings))


def _comparison(
    spec: Spec,
    model: Model,
    fit: Sequence[ModeTable],
    hold_out: Sequence[ModeTable],
    given: Sequence[Index] | None = None,
) -> ModalResidual:
    shapes, pairing = (
        (False, "auto")
        if spec.update is None
        else (spec.update.method == "sensitivity", spec.update.pairing)
    )
    return modal_residual(model, fit, hold_out, shapes, pairing, given)


def update_modal(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[Iteration], None] | None = None,
) -> Updated:
    """Update ``model`` on the measured modes by a trust-region sequence of convex steps.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    begin = time.perf_counter()
    scored = residual_of(spec, model, recordings)
    residual = (
        scored if not scored.hold_out else _comparison(spec, model, scored.fit, ())
    )  # what is only scored takes no part in the loop
    problem, choice, options = (
        step_problem(spec, model, recordings),
        solver_choice(spec),
        loop_options(spec, model),
    )
    loop, paired = with_pairing(residual, problem, choice, options, model.zero(), progress)
    start, end = scored_ends(spec, model, scored, loop)
    relative = all(t.relative_only for t in residual.fit)
    known = uncertainty(
        loop.point.system(), end.p, model.parameters, equality_rows(loop.problem, end.p), relative
    )
    fit = modal_metrics(start, end)
    fit["fit"] |= objective_metric(loop, start, end)
    return updated(
        spec,
        model,
        loop,
        known,
        relative,
        begin,
        method=spec.update.method if spec.update is not None else "frequencies",
        fit=with_responses(fit, model, end.p, recordings),
        notes=(*_notes(start, relative, known), *paired),
        modes=mode_results(start, end),
    )


def with_pairing(
    residual: ModalResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
    """`iterate`, and again from its end where another pairing by frequency fits the updated model
    better: (one loop with the whole history, notes).

    At most `REPAIRINGS` times, within the iterations that are left. The start is the initial model
    in the final pairing.
    """
    loop = iterate(residual, problem, choice, options, p0, progress)
    notes: list[str] = []
    while (
        loop.status == "converged"
        and len(notes) < REPAIRINGS
        and len(loop.history) < options.max_iterations
    ):
        other = another_pairing(loop.point)
        if other is None:
            break
        before, after = (
            objective_at(loop.problem, q)
            for q in (loop.point, replace(loop.point, places=other.places))
        )
        if after >= before * (1.0 - 1e-3):
            break
        chain = loop.history
        again = iterate(
            replace(residual, start=other),
            loop.problem,
            choice,
            replace(options, max_iterations=options.max_iterations - len(chain)),
            loop.point.p,
            progress,
        )
        back = again.start
        for p in [*(h.p for h in reversed(chain) if h.accepted), loop.start.p]:
            back = back.residual.evaluate(np.array(p), back)
        notes.append(_repaired(loop.point, other.places, before, after))
        history = (
            *chain,
            *(replace(h, number=len(chain) + 1 + i) for i, h in enumerate(again.history)),
        )
        loop = replace(again, start=back, history=history, weight=loop.weight)
    return loop, tuple(notes)


def _repaired(point: ModalPoint, places: Sequence[Index], before: float, after: float) -> str:
    changed = [
        f"{table.frequency[i]:.5g} Hz"
        for table, old, new in zip(point.residual.fit, point.places, places, strict=False)
        for i in np.flatnonzero(old != new)
    ]
    return (
        f"After convergence another pairing of {', '.join(changed)} fitted the updated model "
        f"better (objective {before:.4g} → {after:.4g}), so the loop went on with it."
    )


def scored_ends(
    spec: Spec, model: Model, scored: ModalResidual, loop: LoopResult[ModalPoint]
) -> tuple[ModalPoint, ModalPoint]:
    """Start and end of the loop with the modes that are only scored beside the fitted ones,
    followed through the accepted points."""
    if not scored.hold_out:
        return loop.start, loop.point
    again = _comparison(spec, model, scored.fit, scored.hold_out, loop.start.places)
    point = first = again.evaluate(loop.start.p)
    for h in loop.history:
        if h.accepted:
            point = again.evaluate(np.array(h.p), point)
    if not np.array_equal(point.p, loop.point.p):  # the start was moved into the constraints
        point = again.evaluate(loop.point.p, point)
    n = len(scored.fit)
    return (
        replace(first, places=(*loop.start.places, *first.places[n:])),
        replace(point, places=(*loop.point.places, *point.places[n:])),
    )


def _notes(start: ModalPoint, relative: bool, known: Uncertainty) -> tuple[str, ...]:
    notes = []
    residual = start.residual
    unpaired = [
        f"{t.frequency[i]:.5g} Hz"
        for t, places in zip(residual.tables, start.places, strict=True)
        for i in np.flatnonzero(places < 0)
    ]
    if unpaired:
        notes.append(
            f"No mode of the model was left for the measured {', '.join(unpaired)}: not compared."
        )
    muted = [
        f"{residual.fit[k].frequency[i]:.5g} Hz"
        for k, i in sorted(residual.muted)
        if k < len(residual.fit) and residual.fit[k].shapes is not None
    ]
    if residual.shapes and muted:
        notes.append(
            f"The initial model repeats the eigenvalue of the measured {', '.join(muted)}, so "
            "single shapes mean nothing there: only the frequencies of these modes were "
            "fitted."
        )
    unseen = [f"{residual.fit[k].frequency[i]:.5g} Hz" for k, i in sorted(residual.unseen)]
    if residual.shapes and unseen:
        notes.append(
            f"The model's modes paired with the measured {', '.join(unseen)} move none of the "
            "sensors, so only their frequencies were fitted."
        )
    if relative:
        notes.append(RELATIVE)
    elif known.noise > 2.0:
        notes.append(
            f"The residual is {known.noise:.1f} times what the stated deviations allow: the "
            "model still lacks something. The parameters' deviations were enlarged by that "
            "factor."
        )
    return tuple(notes)
