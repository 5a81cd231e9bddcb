"""Model against recordings as `cvxupdate correlate` does it: modes, shapes, frequency responses,
sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.modes import compare_shapes, mode_pairs, node_translations, shape_macs
from cvxupdate.correlate.own_errors import OwnError, of_modes
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.correlate.reciprocal_check import with_reciprocal
from cvxupdate.correlate.response_error import Stated, places, pooled
from cvxupdate.correlate.responses import compare_responses, is_damped
from cvxupdate.correlate.result import (
    Compared,
    FrfComparison,
    Geometry,
    ModePair,
    Part,
    ShapeComparison,
)
from cvxupdate.correlate.sensors import sensor_report
from cvxupdate.errors import InputError
from cvxupdate.fe.internal import internal_forces
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import from_files

Index = NDArray[np.int64]
NOMINAL = 24
"""Modes paired without shapes whose own shapes are kept, at most."""


def geometry_of(spec: Spec, model: Model) -> Geometry | None:
    """Nodes and elements to draw; None when the model has no element between nodes with coordinates
    of their own."""
    at = {int(n): k for k, n in enumerate(model.node_ids)}
    parts = tuple(
        Part(number, block.type, tuple(at[n] for n in nodes))
        for block in spec.model.elements
        if not from_files(block.type)
        for number, nodes in block.drawn()
    )
    used = sorted({n for part in parts for n in part.nodes if len(part.nodes) > 1})
    if not used or np.ptp(model.xyz[used], axis=0).max() == 0.0:
        return None
    moves = np.zeros((len(model.node_ids), 3), dtype=bool)
    rows = np.flatnonzero(model.dof_kind < 3)
    moves[model.dof_node[rows], model.dof_kind[rows]] = True
    return Geometry(model.node_ids, model.xyz, parts, moves)


@dataclass
class _Found:
    """What is gathered, recording by recording: pairs of modes, shapes, curves, the errors of the
    responses, sensors with the recordings that have them and the highest frequency, what to say."""

    said: list[str] = field(default_factory=list)
    pairs: list[ModePair] = field(default_factory=list)
    shapes: list[ShapeComparison] = field(default_factory=list)
    frfs: list[FrfComparison] = field(default_factory=list)
    errors: list[Stated] = field(default_factory=list)
    seen: dict[tuple[int, ...], tuple[list[str], float]] = field(default_factory=dict)

    def sensors(self, rows: Index, name: str, top: float) -> None:
        """Add a recording to those with the same sensors; the highest frequency counts."""
        key = tuple(np.unique(rows[rows >= 0]).tolist())
        names, before = self.seen.get(key, ([], 0.0))
        self.seen[key] = ([*names, name], max(before, top))


def compare(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    modes: Modes,
    paired: Mapping[int, Index],
    shapes: Mapping[int, Real | None],
    warnings: Sequence[Doubt] = (),
) -> Compared:
    """Everything that `correlate` shows, except how long it took.

    Parameters
    ----------
    modes : of the model, rigid-body ones first. paired : for the place of every table of modes in
    ``recordings`` the (modes,) partners among
    ``modes``, −1 unpaired. shapes : likewise the realised shapes (modes, channels), None where the
    table has none. warnings : of `plausible.examine`.

    Raises
    ------
    InputError
        When nothing can be compared; the message says why of every recording.
    """
    flexible, found = modes.flexible(), _Found([*nonlinear_note(model)])
    geometry = geometry_of(spec, model)
    tables = _Tables(model, model.matrices(), flexible, modes.rigid, geometry)
    for k, recording in enumerate(_named(recordings)):
        if isinstance(recording, ModeTable):
            tables.add(found, recording, paired[k], shapes[k])
        else:
            _add_responses(found, model, recording)
    if not found.pairs and not found.frfs:
        raise InputError(
            f"{spec.path}: none of the recordings can be compared with the model. "
            + " ".join(found.said)
        )
    found.shapes = [with_reciprocal(s, found.frfs, found.pairs) for s in found.shapes]
    reports = [
        sensor_report(model, flexible, tuple(names), np.array(rows), top)
        for rows, (names, top) in found.seen.items()
    ]
    return Compared(
        spec.name,
        spec.title,
        spec.source,
        spec.shown,
        0.0,
        tuple(found.pairs),
        tuple(found.shapes),
        tuple(found.frfs),
        tuple(r for r in reports if r is not None),
        metrics(found.pairs, found.errors),
        geometry,
        _sizes(model, modes.rigid),
        _nominal(model, flexible, [] if geometry is None else found.pairs),
        tuple(dict.fromkeys(found.said)),
        recordings=_own(found),
        warnings=tuple(warnings),
    )


def _own(found: _Found) -> tuple[OwnError, ...]:
    off = [m.error_percent for m in found.pairs]
    responses = (OwnError(e.recording, e.use, e.metric, e.value, e.value) for e in found.errors)
    return (*of_modes([(m.recording, m.use) for m in found.pairs], off, off), *responses)


@dataclass(frozen=True)
class _Tables:
    """The model as tables of modes are compared with it."""

    model: Model
    matrices: Matrices
    flexible: Modes
    rigid: int
    geometry: Geometry | None

    def add(self, found: _Found, table: ModeTable, partners: Index, mine: Real | None) -> None:
        """One table, its ``partners`` among the model's modes and its realised shapes."""
        name, flexible = table.origin.name, self.flexible
        at = np.where(partners >= 0, partners - self.rigid, -1)
        found.said += [
            f"{name}: no mode of the model was left for the measured {f:.5g} Hz."
            for f in table.frequency[at < 0]
        ]
        macs = np.full(len(at), np.nan)
        if mine is not None:
            rows = places(self.model, table.channels)
            shape, lines = compare_shapes(
                self.model, self.matrices, flexible, table, mine, rows, at, self.geometry
            )
            found.said += lines
            macs = shape_macs(flexible, mine, rows, at)
            found.shapes += [shape] if shape is not None else []
            top = float(flexible.frequencies[at.max()]) if at.max(initial=-1) >= 0 else 0.0
            found.sensors(rows, name, top)
        found.pairs += mode_pairs(table, flexible, at, macs)


def nonlinear_note(model: Model) -> list[str]:
    """What the linear comparisons leave out; nothing of a linear model."""
    kinds = sorted(set(internal_forces(model).kinds))
    if not kinds:
        return []
    return [
        f"The model has nonlinear elements ({', '.join(kinds)}): its modes and frequency responses "
        "are those of its linear elements; its answers to time histories are simulated."
    ]


def _add_responses(found: _Found, model: Model, recording: FrequencyResponse | TimeHistory) -> None:
    result, lines, errors = compare_responses(model, recording)
    found.said += [line for line in lines if line]
    found.errors += errors
    if result is not None:
        rows = np.array([model.place.get(label, -1) for label in result.responses], dtype=np.int64)
        found.frfs.append(result)
        found.sensors(rows, result.recording, float(result.frequency[-1]))


def _nominal(model: Model, flexible: Modes, pairs: Sequence[ModePair]) -> dict[int, Real]:
    """The model's own shapes of modes that were paired without any."""
    return {
        m.mode: node_translations(model, flexible.shapes[:, m.mode - 1])
        for m in pairs[:NOMINAL]
        if m.mac is None
    }


def _sizes(model: Model, rigid: int) -> dict[str, Any]:
    given = any(b.kind.name == "matrix" for b in model.blocks)
    return {
        "nodes": len(model.node_ids),
        "elements": len({int(i) for b in model.blocks if not b.is_base for i in b.ids}),
        "dofs": model.size,
        "mass": None if given else model.total_mass(),
        "given": given,
        "rigid": rigid,
        "damped": is_damped(model),
    }


def _named(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings of several states with that of each behind the name, of one file distinguished by
    a number."""
    several = len({r.origin.state for r in recordings}) > 1
    names = [
        f"{r.origin.name}, {r.origin.state}" if several and r.origin.state else r.origin.name
        for r in recordings
    ]
    return tuple(
        replace(
            r,
            origin=replace(
                r.origin,
                name=name if names.count(name) == 1 else f"{name} ({names[:k].count(name) + 1})",
            ),
        )
        for k, (r, name) in enumerate(zip(recordings, names, strict=True))
    )


def metrics(
    modes: Sequence[ModePair], errors: Sequence[Stated]
) -> dict[str, dict[str, dict[str, float]]]:
    """The contract's metrics of fitted and held-out recordings, the same under before and after:
    nothing was changed."""
    out: dict[str, dict[str, dict[str, float]]] = {}
    responses = pooled(errors)
    for key, use in (("fit", "fit"), ("hold_out", "hold-out")):
        values: dict[str, float] = {}
        off = [abs(m.error_percent) for m in modes if m.use == use]
        macs = [m.mac for m in modes if m.use == use and m.mac is not None]
        if off:
            values |= {
                "frequency_error_percent_mean": float(np.mean(off)),
                "frequency_error_percent_max": float(np.max(off)),
            }
        if macs:
            values |= {"mac_mean": float(np.mean(macs)), "mac_min": float(np.min(macs))}
        values |= responses[key]
        out[key] = {name: {"before": value, "after": value} for name, value in values.items()}
    return out
