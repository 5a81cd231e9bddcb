"""Model against recordings as `cvxupdate correlate` does it: modes, shapes, frequency responses,
sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.frf import frf_correlation
from cvxupdate.correlate.modes import compare_shapes, mode_pairs, node_translations, shape_macs
from cvxupdate.correlate.response import POWERS, model_frf
from cvxupdate.correlate.result import (
    Compared,
    FrfComparison,
    Geometry,
    ModePair,
    Part,
    SensorReport,
    ShapeComparison,
)
from cvxupdate.errors import InputError, ModelError, RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.spectral import frf_from_time
from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.reduction import qr_places, visibility
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import from_files

Index = NDArray[np.int64]
FDAC_LINES = 120
"""Lines of the FDAC map."""
NOMINAL = 24
"""Modes paired without shapes whose own shapes are kept, at most."""
SEEN_MODES = 24
"""Modes in a sensor report at most."""


def geometry_of(spec: Spec, model: Model) -> Geometry | None:
    """Nodes and elements to draw; None when the model has no element between nodes with coordinates
    of their own."""
    at = {int(n): k for k, n in enumerate(model.node_ids)}
    parts = tuple(
        Part(row.id, block.type, tuple(at[n] for n in row.nodes))
        for block in spec.model.elements
        if not from_files(block.type)
        for row in block.rows
    )
    used = sorted({n for part in parts for n in part.nodes if len(part.nodes) > 1})
    if not used or np.ptp(model.xyz[used], axis=0).max() == 0.0:
        return None
    moves = np.zeros((len(model.node_ids), 3), dtype=bool)
    rows = np.flatnonzero(model.dof_kind < 3)
    moves[model.dof_node[rows], model.dof_kind[rows]] = True
    return Geometry(model.node_ids, model.xyz, parts, moves)


def compare_frf(
    model: Model, frf: FrequencyResponse, how: str = "as measured"
) -> tuple[FrfComparison | None, tuple[str, ...]]:
    """FRFs of one recording beside the model's with the file's damping; None with the reason where
    they cannot be compared.

    Channels that are no motion, and references that are no force, have no counterpart in the model
    and are left out.
    """
    name = frf.origin.name
    if frf.quantity not in POWERS:
        return None, (
            f"{name}: responses of {frf.quantity} have no counterpart in the model; not compared.",
        )
    outputs = [
        k
        for k, c in enumerate(frf.responses)
        if c.dof and c.quantity not in ("force", "strain", "voltage")
    ]
    inputs = [k for k, c in enumerate(frf.references) if c.dof and c.quantity == "force"]
    if not inputs:
        return None, (
            f"{name}: no force was recorded, so its spectra are no frequency responses; not "
            "compared.",
        )
    if not outputs:
        return None, (f"{name}: no response channel sits at a DOF of the model; not compared.",)
    keep = frf.frequency > 0.0
    f, H = frf.frequency[keep], frf.H[keep][:, outputs][:, :, inputs]
    responses, references = [frf.responses[k] for k in outputs], [frf.references[k] for k in inputs]
    own = model_frf(model, f, places(model, responses), places(model, references), frf.quantity)
    variance = None if frf.variance is None else frf.variance[keep][:, outputs][:, :, inputs]
    notes = (
        ()
        if _damped(model)
        else (
            f"{name}: the model has no damping, so its peaks are unlimited and the error of "
            "its responses says little; give the model [model.damping].",
        )
    )
    return FrfComparison(
        name,
        frf.origin.use,
        frf.quantity,
        f,
        H,
        own,
        variance,
        tuple(c.label for c in responses),
        tuple(c.label for c in references),
        frf_correlation(f, own, H, FDAC_LINES),
        how,
    ), notes


def frf_of_time(
    history: TimeHistory, band: tuple[float, float] | None
) -> tuple[FrequencyResponse | None, str]:
    """H1 of a time history over its band, or None with the reason; of several quantities the one
    with most channels (acceleration first)."""
    kinds = [c.quantity for c in history.channels if c.dof]
    found = sorted(
        (q for q in set(kinds) & set(POWERS)), key=lambda q: (-kinds.count(q), -POWERS[q])
    )
    if not found:
        return None, f"{history.origin.name}: no motion was recorded; not compared."
    try:
        frf = frf_from_time(history, quantity=found[0])
    except RecordingError as error:
        return None, f"{history.origin.name}: no frequency responses ({error}); not compared."
    if band is None:
        return frf, ""
    keep = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    if np.count_nonzero(keep) < 2:
        return None, f"{history.origin.name}: fewer than two lines lie in its band; not compared."
    cut = [None if part is None else part[keep] for part in (frf.variance, frf.coherence)]
    return FrequencyResponse(
        frf.origin,
        frf.frequency[keep],
        frf.H[keep],
        frf.quantity,
        frf.responses,
        frf.references,
        *cut,
    ), ""


def places(model: Model, channels: Sequence[Channel]) -> Index:
    """Places among the free DOFs, −1 where a support holds.

    Raises
    ------
    RecordingError
        For a node that the model does not have.
    """
    nodes = set(model.node_ids.tolist())
    for c in channels:
        if c.node not in nodes:
            raise RecordingError(
                f"channel {c.label} sits at node {c.node}, which the model does not have. "
                "Correct the channel."
            )
    return np.array([model.place.get(c.label, -1) for c in channels], dtype=np.int64)


def sensor_report(
    model: Model, flexible: Modes, names: tuple[str, ...], rows: Index, top: float
) -> SensorReport | None:
    """What the sensors ``rows`` see of the modes up to ``top`` Hz (at most 24); None where there is
    nothing to see."""
    rows = np.unique(rows[rows >= 0])
    count = min(int(np.sum(flexible.frequencies <= top)), SEEN_MODES)
    if not count or not len(rows):
        return None
    phi = flexible.shapes[:, :count]
    alike_kind = (
        np.flatnonzero((model.dof_kind < 3) == bool(np.all(model.dof_kind[rows] < 3)))
        if _one_kind(model, rows)
        else np.arange(model.size)
    )
    try:
        seen = visibility(phi, rows, alike_kind)
    except (
        InputError
    ):  # a mode that moves no DOF of the sensors' kind (torsion, seen by translations)
        seen = visibility(phi, rows)
    better, condition = (), None
    if count <= len(rows) < len(alike_kind):
        try:
            chosen = qr_places(phi, len(rows), alike_kind)
            better, condition = (
                tuple(model.labels[i] for i in np.sort(chosen)),
                visibility(phi, chosen).condition,
            )
        except ModelError:
            pass
    return SensorReport(
        names,
        tuple(model.labels[i] for i in rows.tolist()),
        flexible.frequencies[:count],
        seen.rank,
        seen.condition,
        seen.alike,
        seen.peak,
        seen.independence,
        seen.says(),
        better,
        condition,
    )


def compare(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    modes: Modes,
    paired: Mapping[int, Index],
    shapes: Mapping[int, Real | None],
    notes: Sequence[str] = (),
) -> Compared:
    """Everything that `correlate` shows, except how long it took.

    Parameters
    ----------
    modes : of the model, rigid-body ones first. paired : for the place of every table of modes in
    ``recordings`` the (modes,) partners among
    ``modes``, −1 unpaired. shapes : likewise the realised shapes (modes, channels), None where the
    table has none.

    Raises
    ------
    InputError
        When nothing can be compared; the message says why of every recording.
    """
    flexible, said = modes.flexible(), list(notes)
    geometry, matrices = geometry_of(spec, model), model.matrices()
    pairs: list[ModePair] = []
    compared: list[ShapeComparison] = []
    frfs: list[FrfComparison] = []
    seen: dict[tuple[int, ...], tuple[list[str], float]] = {}
    recordings = _named(recordings)
    for k, recording in enumerate(recordings):
        if isinstance(recording, ModeTable):
            at = np.where(paired[k] >= 0, paired[k] - modes.rigid, -1)
            said += [
                f"{recording.origin.name}: no mode of the model was left for the measured "
                f"{f:.5g} Hz."
                for f in recording.frequency[at < 0]
            ]
            mine = shapes[k]
            macs = np.full(len(at), np.nan)
            if mine is not None:
                rows = places(model, recording.channels)
                found, lines = compare_shapes(
                    model, matrices, flexible, recording, mine, rows, at, geometry
                )
                said += lines
                macs = shape_macs(flexible, mine, rows, at)
                compared += [found] if found is not None else []
                _seen(
                    seen,
                    rows,
                    recording.origin.name,
                    float(flexible.frequencies[at.max()]) if at.max(initial=-1) >= 0 else 0.0,
                )
            pairs += mode_pairs(recording, flexible, at, macs)
            continue
        if isinstance(recording, TimeHistory):
            frf, why = frf_of_time(recording, spec.recordings[k].band)
            if frf is None:
                said.append(why)
                continue
            how = "H1 of the time history (Hann window, half overlap)"
        else:
            frf, how = recording, "as measured"
        result, lines = compare_frf(model, frf, how)
        said += lines
        if result is not None:
            frfs.append(result)
            _seen(
                seen,
                places(model, [c for c in frf.responses if c.label in result.responses]),
                result.recording,
                float(result.frequency[-1]),
            )
    if not pairs and not frfs:
        raise InputError(
            f"{spec.path}: none of the recordings can be compared with the model. " + " ".join(said)
        )
    reports = [
        sensor_report(model, flexible, tuple(names), np.array(rows), top)
        for rows, (names, top) in seen.items()
    ]
    given = any(b.kind.name == "matrix" for b in model.blocks)
    sizes = {
        "nodes": len(model.node_ids),
        "elements": len({int(i) for b in model.blocks for i in b.ids}),
        "dofs": model.size,
        "mass": None if given else model.total_mass(),
        "given": given,
        "rigid": modes.rigid,
        "damped": _damped(model),
    }
    nominal = (
        {}
        if geometry is None
        else {
            m.mode: node_translations(model, flexible.shapes[:, m.mode - 1])
            for m in pairs[:NOMINAL]
            if m.mac is None
        }
    )
    return Compared(
        spec.name,
        spec.title,
        spec.source,
        str(spec.path),
        0.0,
        tuple(pairs),
        tuple(compared),
        tuple(frfs),
        tuple(r for r in reports if r is not None),
        metrics(pairs, frfs),
        geometry,
        sizes,
        nominal,
        tuple(dict.fromkeys(said)),
    )


def _named(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings of one file, distinguished by a number behind the name."""
    names = [r.origin.name for r in recordings]
    return tuple(
        r
        if names.count(name) == 1
        else replace(r, origin=replace(r.origin, name=f"{name} ({names[:k].count(name) + 1})"))
        for k, (r, name) in enumerate(zip(recordings, names, strict=True))
    )


def _seen(
    seen: dict[tuple[int, ...], tuple[list[str], float]], rows: Index, name: str, top: float
) -> None:
    """Add a recording to those with the same sensors; the highest frequency counts."""
    key = tuple(np.unique(rows[rows >= 0]).tolist())
    names, before = seen.get(key, ([], 0.0))
    seen[key] = ([*names, name], max(before, top))


def metrics(
    modes: Sequence[ModePair], frfs: Sequence[FrfComparison]
) -> dict[str, dict[str, dict[str, float]]]:
    """The contract's metrics of fitted and held-out recordings, the same under before and after:
    nothing was changed."""
    out: dict[str, dict[str, dict[str, float]]] = {}
    for key, use in (("fit", "fit"), ("hold_out", "hold-out")):
        values: dict[str, float] = {}
        errors = [abs(m.error_percent) for m in modes if m.use == use]
        macs = [m.mac for m in modes if m.use == use and m.mac is not None]
        if errors:
            values |= {
                "frequency_error_percent_mean": float(np.mean(errors)),
                "frequency_error_percent_max": float(np.max(errors)),
            }
        if macs:
            values |= {"mac_mean": float(np.mean(macs)), "mac_min": float(np.min(macs))}
        mine = [c for c in frfs if c.use == use]
        if mine:
            wrong = sum(float(np.sum(np.abs(c.model - c.measured) ** 2)) for c in mine)
            size = sum(float(np.sum(np.abs(c.measured) ** 2)) for c in mine)
            values["frf_error"] = float(np.sqrt(wrong / size)) if size > 0.0 else float("inf")
        out[key] = {name: {"before": value, "after": value} for name, value in values.items()}
    return out


def _one_kind(model: Model, rows: Index) -> bool:
    return len(np.unique(model.dof_kind[rows] < 3)) == 1


def _damped(model: Model) -> bool:
    if any(z > 0.0 for z in model.modal_damping):
        return True
    return any(
        m in ("C", "D") and bool(np.any(np.asarray(v) != 0.0))
        for b, values in zip(model.blocks, model.properties(), strict=True)
        for m, _, v in b.scalars(values)
    )
