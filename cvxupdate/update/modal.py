"""Methods ``frequencies`` and ``sensitivity``: penalty-function updating on modal data (thesis
2.8.1) as convex steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.correlate import mac
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.modal import ModalPoint, ModalResidual, another_pairing, modal_residual
from cvxupdate.residual.pairing import Index, channel_rows, real_shapes
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.covariance import Uncertainty, uncertainty
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.result import Metrics, ModeResult, ParameterResult, Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

AT_BOUND = 1e-6  # of the distance between the bounds
REPAIRINGS = 5  # how often the loop may go on with another pairing


def modal_tables(
    recordings: Sequence[Recording],
) -> tuple[tuple[ModeTable, ...], tuple[ModeTable, ...]]:
    """Mode tables to fit and to score only.

    Raises
    ------
    InputError
        When there is nothing to fit.
    """
    tables = [r for r in recordings if isinstance(r, ModeTable)]
    fit = tuple(t for t in tables if t.origin.use == "fit")
    if not fit:
        raise InputError(
            'methods frequencies and sensitivity need a recording of kind "modes" with use = '
            '"fit". Add one, or identify modes first.'
        )
    return fit, tuple(t for t in tables if t.origin.use != "fit")


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
        step_problem(spec, model),
        solver_choice(spec),
        loop_options(spec, model),
    )
    loop, paired = with_pairing(residual, problem, choice, options, model.zero(), progress)
    start, end = scored_ends(spec, model, scored, loop)
    relative = all(t.relative_only for t in residual.fit)
    known = uncertainty(
        loop.point.system(), end.p, model.parameters, equality_rows(loop.problem, end.p), relative
    )
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=str(spec.path),
        status=loop.status,
        reason=loop.reason,
        method=spec.update.method if spec.update is not None else "frequencies",
        solver=loop.step.solver,
        iterations=len(loop.history),
        parameters=parameter_results(model, end.p, known, relative, len(loop.history) > 0),
        fit=with_responses(modal_metrics(start, end, loop), model, end.p, recordings),
        certificate=certificate_of(loop),
        time=time.perf_counter() - begin,
        conflict=loop.step.conflict if loop.status == "infeasible" else (),
        relaxation=tuple(r.says for r in loop.step.relaxation)
        if loop.status == "infeasible"
        else (),
        modes=mode_results(start, end),
        history=tuple({**asdict(h), "ratio": _number(h.ratio)} for h in loop.history),
        undetermined=tuple(
            {
                "coefficients": dict(c.coefficients),
                "standard_deviation": _number(c.std),
                "says": c.says,
            }
            for c in known.undetermined
        ),
        noise=None if relative else known.noise,
        active=loop.step.active,
        regularisation=regularisation_of(loop),
        model={
            "dofs": model.size,
            "elements": int(sum(len(set(b.ids.tolist())) for b in model.blocks)),
            "nodes": len(model.node_ids),
            "mass_before": model.total_mass(),
            "mass_after": model.total_mass(end.p),
        },
        notes=(*_notes(start, relative, known), *paired),
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


def parameter_results(
    model: Model, p: Array, known: Uncertainty, relative: bool, ran: bool
) -> tuple[ParameterResult, ...]:
    """Parameters in SI units with their deviations and bounds."""
    out = []
    for q, value, std in zip(model.parameters, p.tolist(), known.std.tolist(), strict=True):
        width = q.upper - q.lower if np.isfinite(q.upper - q.lower) else 1.0
        bound = (
            "lower"
            if value <= q.lower + AT_BOUND * width
            else "upper"
            if value >= q.upper - AT_BOUND * width
            else None
        )
        size = abs(q.unit_size)
        out.append(
            ParameterResult(
                q.name,
                q.of,
                q.elements[0] if len(q.elements) == 1 else None,
                q.elements,
                q.group,
                q.unit,
                q.physical(0.0),
                q.physical(value),
                _number(std * size),
                _number(q.physical(q.lower)),
                _number(q.physical(q.upper)),
                bound is not None,
                bound,
                value,
                _number(std),
            )
        )
    return tuple(out)


def mode_results(start: ModalPoint, end: ModalPoint) -> tuple[ModeResult, ...]:
    """Every measured mode beside its partner, before and after."""
    out = []
    tables = start.residual.tables
    for k, table in enumerate(tables):
        before, after = start.frequencies(k), end.frequencies(k)
        mac_before, mac_after = _macs(start, k), _macs(end, k)
        for i, fx in enumerate(table.frequency.tolist()):
            if start.places[k][i] < 0 or end.places[k][i] < 0:
                continue
            out.append(
                ModeResult(
                    table.origin.name,
                    table.origin.use,
                    fx,
                    float(table.frequency_std[i]),
                    float(before[i]),
                    float(after[i]),
                    100 * abs(float(before[i]) - fx) / fx,
                    100 * abs(float(after[i]) - fx) / fx,
                    int(start.places[k][i]) - start.modes.rigid + 1,
                    int(end.places[k][i]) - start.modes.rigid + 1,
                    _number(mac_before[i]),
                    _number(mac_after[i]),
                )
            )
    return tuple(out)


def modal_metrics(
    start: ModalPoint, end: ModalPoint, loop: LoopResult[ModalPoint] | None
) -> dict[str, Metrics]:
    """The contract's metrics for the fitted and the held-out modes."""
    modes = mode_results(start, end)
    out: dict[str, Metrics] = {}
    for key, use in (("fit", "fit"), ("hold_out", "hold-out")):
        mine = [m for m in modes if m.use == use]
        metrics: Metrics = {}
        if mine:
            b, a = np.array([m.error_before for m in mine]), np.array([m.error_after for m in mine])
            metrics["frequency_error_percent_mean"] = {
                "before": float(b.mean()),
                "after": float(a.mean()),
            }
            metrics["frequency_error_percent_max"] = {
                "before": float(b.max()),
                "after": float(a.max()),
            }
            pairs = [
                (m.mac_before, m.mac_after)
                for m in mine
                if m.mac_before is not None and m.mac_after is not None
            ]
            if pairs:
                for name, f in (("mac_mean", np.mean), ("mac_min", np.min)):
                    metrics[name] = {
                        "before": float(f([x for x, _ in pairs])),
                        "after": float(f([y for _, y in pairs])),
                    }
        out[key] = metrics
    if loop is not None and not any(isinstance(r.weight, str) for r in loop.problem.regularisers):
        out["fit"]["objective"] = {
            "before": objective_at(loop.problem, start),
            "after": objective_at(loop.problem, end),
        }
    return out


def _macs(point: ModalPoint, k: int) -> Array:
    table = point.residual.tables[k]
    out = np.full(len(table.frequency), np.nan)
    if table.shapes is None:
        return out
    rows, shapes = channel_rows(table, point.residual.model), real_shapes(table.shapes)
    for i, at in enumerate(point.places[k].tolist()):
        ok = (rows >= 0) & np.isfinite(shapes[i])
        if at >= 0 and ok.sum() >= 2:
            out[i] = mac(point.modes.shapes[rows[ok], at][:, None], shapes[i][ok][:, None])[0, 0]
    return out


def certificate_of(loop: LoopResult[Any]) -> dict[str, object]:
    """The certificate of the last step, as the contract names its parts."""
    c = loop.step.certificate
    out: dict[str, object] = dict(c.as_dict())
    out |= {
        "primal_residual": out.pop("primal"),
        "dual_residual": out.pop("dual"),
        "optimal": c.is_optimal(),
        "says": loop.step.says,
    }
    if loop.step.infeasibility is not None:
        out["infeasibility"] = asdict(loop.step.infeasibility)
    return out


def regularisation_of(loop: LoopResult[Any]) -> tuple[dict[str, object], ...]:
    """Each regulariser with its weight and how it was chosen."""
    out: list[dict[str, object]] = []
    for r in loop.problem.regularisers:
        chosen = loop.weight
        rule = chosen.rule if chosen is not None and r.weight == chosen.weight else None
        out.append(
            {
                "kind": r.name,
                "weight": r.weight,
                "rule": rule,
                "note": chosen.note if rule and chosen is not None else "",
            }
        )
    return tuple(out)


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
        notes.append(
            "The recordings state no deviations: their weights are relative, and the "
            "parameters' deviations come from the scatter of the residual."
        )
    elif known.noise > 2.0:
        notes.append(
            f"The residual is {known.noise:.1f} times what the stated deviations allow: the "
            "model still lacks something. The parameters' deviations were enlarged by that "
            "factor."
        )
    return tuple(notes)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
