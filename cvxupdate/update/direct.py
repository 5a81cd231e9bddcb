"""Method ``direct``: the closed-form methods of the literature on the measured modes of a problem
(thesis 2.7), with what each does wrong."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.correlate import mac
from cvxupdate.direct.methods import METHODS, DirectMethod, Request
from cvxupdate.direct.result import DirectUpdate, faults
from cvxupdate.errors import CvxupdateError, InputError
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.ceam_expand import expand
from cvxupdate.residual.ceam_modes import AssignedMode, assigned_modes
from cvxupdate.residual.shape_rows import channel_rows, real_shapes
from cvxupdate.spec import Spec
from cvxupdate.update.measured_modes import metrics_of, modal_tables
from cvxupdate.update.outcome import finite, model_facts
from cvxupdate.update.result import DirectResult, ModeResult, Updated

LARGEST = 1500
"""DOFs up to which dense matrices are worked with."""
SURPLUS = 6
"""Modes computed beyond the measured ones, among which partners are sought."""
NO_CERTIFICATE = (
    "A closed formula was evaluated, not a convex program solved: there is nothing to certify. It "
    "knows no bounds, no clauses and no deviations of the recordings; what came of that is "
    "measured in the table of direct methods."
)


@dataclass(frozen=True, eq=False)
class _Scene:
    """The model's matrices, its modes, and the tables to fit and to hold out."""

    model: Model
    m: Matrices
    modes: Modes
    tables: tuple[ModeTable, ...]
    request: Request


def update_direct(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Updated:
    """Matrices by the direct method that [update] names, beside all the others.

    Raises
    ------
    InputError
        Where there are no measured shapes, the model is too large, or the method named cannot be
        applied.
    """
    begin = time.perf_counter()
    if spec.update is None:
        raise InputError(f"{spec.path}: there is no [update] table. Add one with a method.")
    if model.size > LARGEST:
        raise InputError(
            f"{spec.path}: the direct methods work on dense matrices; {model.size} DOFs are more "
            f"than {LARGEST}. Take method ceam."
        )
    scene = _scene(spec, model, recordings)
    rows, chosen = [], None
    for method in METHODS:
        row, made = _tried(scene, method)
        rows.append(row)
        if method.name == spec.update.direct:
            if made is None:
                raise InputError(f"{spec.path}: update.direct = {method.name!r}: {row.why}")
            chosen = made
    if chosen is None:
        raise InputError(f"{spec.path}: there is no direct method {spec.update.direct!r}.")
    results = _mode_results(scene, chosen)
    row = next(r for r in rows if r.name == spec.update.direct)
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=spec.shown,
        status="converged",
        reason=f"{row.title}: a formula, evaluated once",
        method=f"direct: {row.name}",
        solver="none",
        iterations=0,
        parameters=(),
        fit={
            key: metrics_of([r for r in results if r.use == use])
            for key, use in (("fit", "fit"), ("hold_out", "hold-out"))
        },
        certificate={"none": True, "says": NO_CERTIFICATE},
        time=time.perf_counter() - begin,
        modes=results,
        model={"clauses": (), **model_facts(model, model.zero())},
        notes=(
            f"shapes were expanded to all {model.size} DOFs by {spec.update.expansion}"
            if any(len(r) < model.size for r in _measured(scene))
            else "shapes were measured at every DOF",
        ),
        caveats=row.says,
        direct=tuple(rows),
    )


def _measured(scene: _Scene) -> list[NDArray[np.int64]]:
    return [channel_rows(t, scene.model) for t in scene.tables]


def _scene(spec: Spec, model: Model, recordings: Sequence[Recording]) -> _Scene:
    fit, held = modal_tables(recordings)
    if not any(t.shapes is not None for t in fit):
        raise InputError(
            'method direct needs measured mode shapes: a recording of kind "modes" with use = '
            '"fit" whose rows have a `shape`. Frequencies alone are for method frequencies.'
        )
    assigned = [m for m in assigned_modes(model, [_undamped(t) for t in fit])]
    m = model.matrices()
    count = min(model.size, len(assigned) + sum(len(t.frequency) for t in held) + SURPLUS)
    modes = model_modes(model, count)
    expansion = spec.update.expansion if spec.update is not None else "null-space"
    Phi = np.column_stack([_full(mode, m, expansion, modes) for mode in assigned])
    M = np.asarray(m.M.toarray())
    Phi = Phi / np.sqrt(np.einsum("ij,ij->j", Phi, M @ Phi))
    likeness = mac(modes.shapes, Phi)
    partners = _partners(likeness)
    own = modes.shapes[:, partners]
    own = own / np.sqrt(np.einsum("ij,ij->j", own, M @ own))
    own = own * np.where(np.einsum("ij,ij->j", own, M @ Phi) < 0.0, -1.0, 1.0)
    request = Request(
        np.asarray(m.K.toarray()),
        M,
        Phi,
        np.array([abs(mode.s) ** 2 for mode in assigned]),
        own,
        np.asarray(modes.eigenvalues)[partners],
        partners,
    )
    return _Scene(model, m, modes, (*fit, *held), request)


def _undamped(table: ModeTable) -> ModeTable:
    """Real shapes and no damping: what these methods take."""
    from dataclasses import replace

    shapes = None if table.shapes is None else real_shapes(table.shapes)
    return replace(table, shapes=shapes, damping=np.full(len(table.frequency), np.nan))


def _full(mode: AssignedMode, m: Matrices, expansion: str, modes: Modes) -> NDArray[np.float64]:
    return np.asarray(np.real(expand(mode, m, expansion, modes)), dtype=np.float64)


def _partners(likeness: NDArray[np.float64]) -> NDArray[np.int64]:
    """For each measured mode a mode of the model of its own, of the largest MACs in sum."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(-likeness.T)
    out = np.empty(likeness.shape[1], dtype=np.int64)
    out[rows] = columns
    return out


def _tried(scene: _Scene, method: DirectMethod) -> tuple[DirectResult, DirectUpdate | None]:
    """The figures of one method; those that cannot be had are None, and ``why`` says so."""
    r = scene.request
    nothing = DirectResult(method.name, method.title, method.equations, method.changes)
    try:
        made = method.apply(r)
        if not all(np.all(np.isfinite(a)) for a in (made.M, made.K)):
            raise InputError("gives entries that are no numbers")
    except (CvxupdateError, la.LinAlgError, ValueError) as error:
        return _with(nothing, why=str(error)), None
    damped = made.C is not None
    found = faults(
        made,
        r.K,
        r.M,
        r.complex_shapes if damped else r.Phi,
        r.rates if damped else r.eigenvalues,
    )
    results = _mode_results(scene, made)
    scores = {
        use: metrics_of([x for x in results if x.use == use]).get(
            "frequency_error_percent_mean", {}
        )
        for use in ("fit", "hold-out")
    }
    row = _with(
        nothing,
        stiffness_change=float(np.linalg.norm(made.K - r.K) / np.linalg.norm(r.K)),
        mass_change=float(np.linalg.norm(made.M - r.M) / np.linalg.norm(r.M)),
        fit_error=scores["fit"].get("after"),
        hold_out_error=scores["hold-out"].get("after"),
        reproduction=found.reproduction,
        mass_min=found.mass_min,
        stiffness_min=found.stiffness_min,
        new_entries=found.new_entries,
        spurious=found.spurious,
        says=found.says,
    )
    return row, made


def _with(row: DirectResult, **changes: object) -> DirectResult:
    return DirectResult(**{**asdict(row), **changes})


def _mode_results(scene: _Scene, made: DirectUpdate) -> tuple[ModeResult, ...]:
    """Measured modes beside those of the model and of the updated matrices: by MAC where shapes are
    known, else the nearest frequency."""
    frequency, shapes = _natural(made)
    before = np.sqrt(np.maximum(scene.modes.eigenvalues, 0.0)) / (2.0 * np.pi)
    rigid = scene.modes.rigid
    out = []
    for table in scene.tables:
        rows = channel_rows(table, scene.model)
        for i, f in enumerate(table.frequency.tolist()):
            a, mac_a = _nearest(table, i, rows, before, scene.modes.shapes)
            b, mac_b = _nearest(table, i, rows, frequency, shapes)
            out.append(
                ModeResult(
                    table.origin.name,
                    table.origin.use,
                    f,
                    float(table.frequency_std[i]),
                    float(before[a]),
                    float(frequency[b]),
                    100.0 * abs(float(before[a]) - f) / f,
                    100.0 * abs(float(frequency[b]) - f) / f,
                    a - rigid + 1,
                    b - rigid + 1,
                    finite(mac_a),
                    finite(mac_b),
                )
            )
    return tuple(out)


def _natural(made: DirectUpdate) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies (Hz) and shapes of the updated matrices, lowest first; undamped. A matrix pair
    that is not definite has its eigenvalues all the same, those below zero at 0 Hz."""
    K, M = 0.5 * (made.K + made.K.T), 0.5 * (made.M + made.M.T)
    try:
        values, vectors = la.eigh(K, M)
    except la.LinAlgError:
        wide, wider = la.eig(K, M)
        keep = np.isfinite(wide) & (np.abs(wide.imag) <= 1e-6 * np.abs(wide))
        rank = np.argsort(wide[keep].real)
        values, vectors = wide[keep].real[rank], wider[:, keep].real[:, rank]
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), np.asarray(vectors)


def _nearest(
    table: ModeTable,
    i: int,
    rows: NDArray[np.int64],
    frequency: NDArray[np.float64],
    shapes: NDArray[np.float64],
) -> tuple[int, float]:
    f = float(table.frequency[i])
    if table.shapes is not None:
        shape = real_shapes(table.shapes)[i]
        ok = (rows >= 0) & np.isfinite(shape)
        if ok.sum() >= 2:
            likeness = mac(shapes[rows[ok]], shape[ok][:, None])[:, 0]
            # of modes that these places cannot tell from one another, the nearest
            alike = np.flatnonzero(likeness > likeness.max() - 0.02)
            best = int(alike[np.argmin(np.abs(frequency[alike] - f))])
            return best, float(likeness[best])
    return int(np.argmin(np.abs(frequency - f))), float("nan")
