"""Methods ``frequencies``, ``sensitivity`` and ``minimum-variance``: updating on modal data by
penalty functions (thesis 2.8.1, 2.8.2) as convex steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.parallel import Where
from cvxupdate.recordings.types import Recording
from cvxupdate.residual.modal import ModalPoint, ModalResidual
from cvxupdate.spec import Spec
from cvxupdate.spec.given import again
from cvxupdate.spec.grammar import Own
from cvxupdate.system import Array
from cvxupdate.update.basins import basins, starts_notes, starts_report
from cvxupdate.update.covariance import Uncertainty, uncertainty
from cvxupdate.update.invisible import invisible
from cvxupdate.update.measured_modes import modal_metrics, mode_results
from cvxupdate.update.modal_fit import ModalFit, comparison, modal_fit, residual_of
from cvxupdate.update.outcome import RELATIVE, objective_metric, updated
from cvxupdate.update.parts import equality_rows
from cvxupdate.update.result import Updated
from cvxupdate.update.score import scored as with_responses
from cvxupdate.update.starts import Kept, Many, StartEnd, mark_of, random_starts, run_starts
from cvxupdate.update.trust_region import Iteration, LoopResult

__all__ = ["residual_of", "update_modal"]


def update_modal(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[Iteration], None] | None = None,
    many: Many | None = None,
) -> Updated:
    """Update ``model`` on the measured modes by a trust-region sequence of convex steps: penalty
    functions (2.98, 2.102, 2.103, 2.104), weighted by the deviations (2.105, 2.106); from the best
    of many starts where [update] asks for them (``many`` says how they are run).

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    begin = time.perf_counter()
    scored = residual_of(spec, model, recordings)
    fit = modal_fit(spec, model, recordings)
    ends = _all_starts(spec, fit, recordings, many or Many())
    best = min(ends, key=lambda e: e.objective, default=None)
    p0 = model.zero() if best is None or best.number == 0 else _start(spec, model, best.number)
    loop, paired = fit.run(p0, progress)
    if np.any(p0):
        loop = replace(loop, start=fit.residual.evaluate(model.zero()))
    start, end = scored_ends(spec, model, scored, loop)
    relative = all(t.relative_only for t in fit.residual.fit)
    known = uncertainty(
        loop.point.system(),
        end.p,
        model.parameters,
        equality_rows(loop.problem, end.p),
        relative,
        invisible(model, end.p),
    )
    if loop.covariance is not None:  # the method's own, which includes what was known before
        V = loop.covariance
        known = replace(known, covariance=V, std=np.sqrt(np.diag(V)))
    metrics = modal_metrics(start, end)
    metrics["fit"] |= objective_metric(loop, start, end)
    report = _basins_report(fit, ends)
    return updated(
        spec,
        model,
        loop,
        known,
        relative,
        begin,
        method=spec.update.method if spec.update is not None else "frequencies",
        fit=with_responses(metrics, model, end.p, recordings),
        notes=(*_notes(start, relative, known), *paired, *starts_notes(report)),
        modes=mode_results(start, end),
        starts=report,
    )


def _basins_report(fit: ModalFit, ends: Sequence[StartEnd]) -> dict[str, Any]:
    """The minima that the starts reached, with the fit at each; empty where there were none."""
    if not ends:
        return {}
    nominal = fit.residual.evaluate(fit.residual.model.zero())

    def fit_at(p: Array) -> dict[str, float]:
        found = modal_metrics(nominal, fit.residual.evaluate(p, nominal))["fit"]
        return {name: value["after"] for name, value in found.items()}

    local = replace(fit, shapes_first=False, release=False)

    def descent(p: Array) -> Array:
        return np.array(local.solve(0, p).p)

    minima = basins(ends, fit.objective, descent)
    return starts_report(ends, minima, fit.residual.model.parameters, fit_at)


def _start(spec: Spec, model: Model, number: int) -> Array:
    u = spec.update
    return model.zero() if u is None else random_starts(model, u.starts, u.seed)[number - 1]


def _all_starts(
    spec: Spec, fit: ModalFit, recordings: Sequence[Recording], many: Many
) -> tuple[StartEnd, ...]:
    """The ends of the nominal and of all random starts; none where [update] asks for none."""
    u, model = spec.update, fit.residual.model
    if u is None or not u.starts:
        return ()
    tasks = [(0, model.zero()), *enumerate(random_starts(model, u.starts, u.seed), 1)]
    text = spec.path.read_bytes() if spec.path.is_file() else again(spec).encode()
    m = model.matrices()
    data = [t.frequency.tobytes() for t in fit.residual.fit]
    data += [np.asarray(t.shapes).tobytes() for t in fit.residual.fit if t.shapes is not None]
    data += [t.covariance.tobytes() for t in fit.residual.fit if t.covariance is not None]
    kept = Kept(many.keep, mark_of(text, m.K.data.tobytes(), m.M.data.tobytes(), *data))
    if many.open_ is None or spec.own != Own():  # objects stay in this process
        return run_starts(tasks, lambda: fit.solve, {}, kept, Where(1), many.progress)
    return run_starts(tasks, many.open_, {"problem": again(spec)}, kept, many.where, many.progress)


def scored_ends(
    spec: Spec, model: Model, scored: ModalResidual, loop: LoopResult[ModalPoint]
) -> tuple[ModalPoint, ModalPoint]:
    """Start and end of the loop with the modes that are only scored beside the fitted ones,
    followed through the accepted points."""
    if not scored.hold_out:  # the modes of the end once more, counted
        return loop.start, scored.evaluate(loop.point.p, loop.point)
    again = comparison(spec, model, scored.fit, scored.hold_out, loop.start.places)
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
    notes += [
        f"The {len(j.at)} rows of {residual.fit[j.table].origin.name} were weighed by the "
        "covariance of their errors, correlations included (V_εε of 2.106)."
        for j in start.joints
    ]
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
