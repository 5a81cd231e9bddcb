"""The model before and after, beside its recordings: natural frequencies, shapes, what was measured
where. What `correlate` compares, and what the page of `diagnose` shows of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.errors import CvxupdateError, InputError

if TYPE_CHECKING:
    from cvxupdate.correlate.plausible import Doubt
    from cvxupdate.correlate.result import Compared
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.diagnose.shown import Beside, ModeBeside
    from cvxupdate.fe.block import Index
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.types import Recording
    from cvxupdate.spec import Spec

MODES_IN_BAND = 30  # computed for the sensors of frequency responses
RATIOS = "damping ratios"
TOLD = {
    "responses": "frequency responses or time histories",
    "modes": "natural frequencies and mode shapes",
    "motion": "time histories at a level where it shows",
    RATIOS: "measured damping ratios",
}
MOST = 12
"""Modes of the model that are shown beside responses."""


def compared(
    spec: Spec, model: Model, recordings: Sequence[Recording], warnings: Sequence[Doubt] = ()
) -> Compared:
    """`correlate`, of a problem that was opened.

    Raises
    ------
    InputError
        Where nothing can be compared.
    """
    from cvxupdate.correlate.compare import compare
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.recordings.types import ModeTable
    from cvxupdate.residual.pairing import needed_modes, start_pairing
    from cvxupdate.residual.shape_rows import real_shapes

    if not recordings:
        raise InputError(
            f"{spec.path}: no recording to compare the model with. Add a [[recordings]] table."
        )
    found = sorted(
        ((k, r) for k, r in enumerate(recordings) if isinstance(r, ModeTable)),
        key=lambda item: item[1].origin.use != "fit",
    )
    tables = [r for _, r in found]
    modes = model_modes(
        model, max(needed_modes(tables), 0 if len(tables) == len(recordings) else MODES_IN_BAND)
    )
    pairing = spec.update.pairing if spec.update is not None else "auto"
    places: dict[int, Index] = {}
    for state in dict.fromkeys(t.origin.state for t in tables):  # each has every mode of its own
        own = [(k, t) for k, t in found if t.origin.state == state]
        fitted = sum(t.origin.use == "fit" for _, t in own)
        start = start_pairing(model, modes, [t for _, t in own], pairing, fitted)
        places |= {k: at for (k, _), at in zip(own, start.places, strict=True)}
    shapes = {k: None if t.shapes is None else real_shapes(t.shapes) for k, t in found}
    return compare(
        spec,
        model,
        recordings,
        modes,
        places,
        shapes,
        warnings,
    )


def reopened(spec: Spec, found: Diagnosis) -> tuple[Spec, Model] | None:
    """The updated model of a diagnosis as its file will be read; None where there is none.

    Raises
    ------
    CvxupdateError
        Where it is no structure.
    """
    from cvxupdate.fe.analysis import as_stated
    from cvxupdate.fe.build import build_model
    from cvxupdate.spec import read_text

    if found.updated is None:
        return None
    other = read_text(found.updated.text, spec.path)
    return other, as_stated(other, build_model(other))


def beside(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    found: Diagnosis,
    after: tuple[Spec, Model] | None = None,
) -> Beside | None:
    """What the page of a diagnosis shows of the two models; None where they cannot be compared.
    Beside a reference state the recordings of the other one, which the diagnosis is of. ``after``:
    its updated model, where that was reopened before."""
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.diagnose.shown import Beside
    from cvxupdate.recordings.states import REFERENCE
    from cvxupdate.recordings.types import ModeTable

    sensors, forces = measured_at(recordings)
    where = Beside(geometry_of(spec, model), sensors, forces, (), untried(spec, found))
    today = [r for r in recordings if r.origin.state != REFERENCE] or recordings
    tables = [r for r in today if isinstance(r, ModeTable)]
    try:
        after = reopened(spec, found) if after is None else after
        if not tables:
            return replace(where, modes=_of_models(model, after and after[1], _top(recordings)))
        first = compared(spec, model, tables)
        second = None if after is None else compared(*after, tables)
        return replace(where, modes=_of_tables(first, second, len(model.node_ids)))
    except CvxupdateError:
        return where


def untried(spec: Spec, found: Diagnosis) -> tuple[tuple[str, str], ...]:
    """(effect, reason) of every effect of the catalogue of which no place was tried; what explains
    too little to be listed was."""
    from cvxupdate.registry import EFFECTS

    seen = {str(c.get("physics")) for c in found.candidates} | {f.physics for f in found.findings}
    seen |= set(found.details.get("tried", ()))
    sought = found.details.get("sought")
    asked = spec.diagnose.physics if spec.diagnose is not None else None
    kinds = {"modes" if r.kind == "modes" else "responses" for r in spec.recordings}
    kinds |= {"motion" for r in spec.recordings if r.kind == "time"}
    rows = [row for r in spec.recordings if r.kind == "modes" for row in r.rows or ()]
    kinds |= {RATIOS for row in rows if row.damping}
    out: dict[str, str] = {}
    for effect in EFFECTS.members():
        if effect.name in seen:
            continue
        if asked is not None and effect.name not in asked:
            why = "left out by the problem file ([diagnose] physics)"
        elif not kinds & set(effect.told_by):
            needs = " or ".join(TOLD.get(k, k) for k in sorted(effect.told_by))
            why = f"these recordings cannot show it: it takes {needs}"
        elif kinds & set(effect.told_by) == {RATIOS}:
            why = "at no place does it explain the measured damping ratios by more than chance"
        elif sought is None:
            why = "no place for it in this model, or none that explains enough to be listed"
        elif not sought:
            why = "not sought, for the reason that the verdict gives"
        elif effect.name not in sought:
            why = "not sought: only the damping departs from the usual scatter"
        else:
            why = "no place for it in this model"
        told = set(effect.name.split("_")) <= set(effect.noun.split())
        out.setdefault(effect.name, why if told else f"{effect.noun}: {why}")
    return tuple(sorted(out.items()))


def measured_at(recordings: Sequence[Recording]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Labels of the sensors and of the forces of all recordings, each once."""
    from cvxupdate.recordings.types import FrequencyResponse

    sensors: dict[str, None] = {}
    forces: dict[str, None] = {}
    for r in recordings:
        if isinstance(r, FrequencyResponse):
            sensors |= dict.fromkeys(c.label for c in r.responses)
            forces |= dict.fromkeys(c.label for c in r.references)
            continue
        for c in r.channels:
            (forces if c.quantity == "force" else sensors)[c.label] = None
    return tuple(sensors), tuple(forces)


def _top(recordings: Sequence[Recording]) -> float:
    """The highest frequency of the responses, Hz."""
    from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

    tops = [float(r.frequency[-1]) for r in recordings if isinstance(r, FrequencyResponse)]
    tops += [
        r.band[1] if r.band is not None else 0.5 * r.rate
        for r in recordings
        if isinstance(r, TimeHistory)
    ]
    return max(tops, default=0.0)


def _of_models(model: Model, other: Model | None, top: float) -> tuple[ModeBeside, ...]:
    """The modes of the model as it came up to ``top`` Hz, and of the other the one most like each
    (MAC of the translations), none twice."""
    from cvxupdate.correlate.mac import mac
    from cvxupdate.correlate.modes import node_translations
    from cvxupdate.diagnose.shown import ModeBeside
    from cvxupdate.fe.modes import model_modes

    first = model_modes(model, MOST).flexible()
    shapes = [node_translations(model, s) for s in first.shapes.T]
    known = [k for k, f in enumerate(first.frequencies) if f <= top][:MOST]
    if other is None:
        return tuple(
            ModeBeside("", "fit", None, float(first.frequencies[k]), shape_before=shapes[k])
            for k in known
        )
    second = model_modes(other, MOST + 6).flexible()
    n = len(model.node_ids)  # effects may have added nodes behind those of the file
    others = [node_translations(other, s)[:n] for s in second.shapes.T]
    flat = [np.stack([s.ravel() for s in each], axis=1) for each in (shapes, others)]
    alike = mac(flat[0], flat[1])
    free = set(range(len(others)))
    out = []
    for k in known:
        best = max(free, key=lambda j: float(alike[k, j]), default=None)
        if best is None or alike[k, best] < 0.3:
            out.append(ModeBeside("", "fit", None, float(first.frequencies[k])))
            continue
        free.discard(best)
        before, after = shapes[k], others[best]
        out.append(
            ModeBeside(
                "",
                "fit",
                None,
                float(first.frequencies[k]),
                float(second.frequencies[best]),
                shape_before=before if float(np.sum(before * after)) >= 0.0 else -before,
                shape_after=after,
            )
        )
    return tuple(out)


def _of_tables(first: Compared, second: Compared | None, nodes: int) -> tuple[ModeBeside, ...]:
    """Every measured mode that either model has a partner for, at the ``nodes`` of the first model:
    effects may have added others behind those."""
    from cvxupdate.diagnose.shown import ModeBeside

    sides = [{(m.recording, m.number): m for m in c.modes} for c in (first, second) if c]
    keys = sorted({k for side in sides for k in side}, key=lambda k: (k[0], k[1]))
    out = []
    for key in keys:
        a = sides[0].get(key)
        b = sides[1].get(key) if second is not None else None
        measured = a or b
        if measured is None:
            continue
        before, _ = _drawn(first, key, a.mode if a else None)
        after, motion = _drawn(second, key, b.mode if b else None)
        if second is None:
            before, motion = _drawn(first, key, a.mode if a else None)
        after = None if after is None else after[:nodes]
        motion = tuple(m for m in motion if m[0] < nodes)
        if before is not None and after is not None:
            before = before if float(np.sum(before * after)) >= 0.0 else -before
        out.append(
            ModeBeside(
                measured.recording,
                measured.use,
                measured.measured,
                a.model if a else None,
                b.model if b else None,
                a.mac if a else None,
                b.mac if b else None,
                before,
                after,
                motion,
            )
        )
    return tuple(out)


def _drawn(
    c: Compared | None, key: tuple[str, int], mode: int | None
) -> tuple[np.ndarray | None, tuple[tuple[int, int, complex], ...]]:
    """(translations (nodes, 3) of the model's partner, what was measured: (row of the geometry,
    0..2 for x..z, value)) of one measured mode."""
    if c is None or mode is None:
        return None, ()
    for s in c.shapes:
        places = np.flatnonzero(s.measured_number == key[1])
        if s.recording != key[0] or not len(places):
            continue
        p = int(places[0])
        shape = None if s.model_shapes is None else np.asarray(s.model_shapes[:, :, p])
        values = np.asarray(s.correlation.shapes_measured)[:, p]
        motion = tuple(
            (int(n), int(kind), complex(v))
            for n, kind, v in zip(s.nodes, s.kinds, values, strict=True)
            if kind < 3 and np.isfinite(v)
        )
        return shape, motion
    return c.nominal.get(mode), ()
