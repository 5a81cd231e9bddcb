"""The diagnosed model as a problem file: what was found stands in it as elements, sections, factors
and corrections, ready to run again.

The matrices of the file built anew are those of the diagnosis: nuisance parameters are factors on
elements, a changed section is a section of its own, an opened joint two tied nodes and a spring, a
hidden oscillator a node of its own. Where sheets were diagnosed on finer parts of their elements,
[model] `refine` says so. What cannot be written down is the correction for the mesh of lines: the
file's frequencies are those of the analyst's mesh (`cvxupdate.diagnose.output.refine` writes it on
a finer one).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.results import Updated
from cvxupdate.errors import ModelError
from cvxupdate.fe.generic.entries import GenericChange
from cvxupdate.fe.generic.members import member_rows
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.physics import writers
from cvxupdate.physics.draft import Draft, change, draft_of
from cvxupdate.physics.fault import Fault, named
from cvxupdate.recordings.types import FrequencyResponse, Recording
from cvxupdate.registry import ELEMENTS
from cvxupdate.spec import Spec, check_text
from cvxupdate.spec.given import UNNAMED
from cvxupdate.spec.write import Written, compacted, to_toml

NOT_KEPT = ("update", "constraints", "regularisation")  # where [update] does not fit
SHARPEN = {"method": "rfm", "residual": "receptance", "frequency_points": "all"}
"""How responses are fitted again from where a diagnosis ended: on every line, by the output error.
The default avoids the resonances, where most of the error of a model close to its recordings is:
what it gains between them it then loses there."""


def with_damping(model: Updated, damped: tuple[Model, float] | None) -> Updated:
    """With an effect of damping beside, whose model has one more parameter, the last; of the others
    those that a file has words for."""
    if damped is None:
        return model
    grown, size = damped
    grown = grown.with_parameters((*model.model.parameters, grown.parameters[-1]))
    return replace(model, model=grown, p=np.append(model.p, size))


def updated_problem(
    spec: Spec, recordings: Sequence[Recording], updated: Updated, says: Sequence[str] = ()
) -> Written | None:
    """The file of a diagnosed model, ``recordings`` in the order of the file; None where the
    grammar has no element for it."""
    try:
        return problem_file(spec, updated, _labels(recordings), (*says, *updated.notes))
    except ModelError:
        return None


def problem_file(
    spec: Spec,
    updated: Updated,
    channels: Sequence[frozenset[str]] = (),
    says: Sequence[str] = (),
    command: str = "diagnose",
) -> Written:
    """A problem file of a model that ``command`` changed.

    Damping ratios are beside what dashpots and loss factors of the model give (None: the damping of
    ``spec`` stays); faults are in the order in which they act, ``channels`` the labels of each
    recording that may have them; pairs are recording → the flexible mode of each row, for tables
    that fix their pairing; ``says`` goes into the comment on top. An [update] of the file is kept
    where it still holds; where there was none, one for what was found is written.

    Raises
    ------
    ModelError
        For an element that the grammar has no type for, or a property below zero that cannot be.
    """
    model, p, damped = updated.model, updated.p, updated.zeta is not None
    draft, written = draft_of(spec, model), writers()
    values = model.properties(p)
    for block, now in zip(model.blocks, values, strict=True):
        if block.is_base or isinstance(block.kind, GenericChange):
            continue  # rows of [[model.bases]] and [[model.families]]
        for e, number in enumerate(block.ids.tolist()):
            here = {k: float(np.real(v[e])) for k, v in now.items()}
            if number in draft.rows:
                change(draft, model, block, e, here, damped)
            elif block.kind.name in written:
                written[block.kind.name](draft, model, block, e, here)
            else:
                raise ModelError(
                    f"the diagnosis added a {block.kind.name} element, for which a problem file "
                    "has no type."
                )
    found = member_rows(
        model.families, dict(zip((q.name for q in model.parameters), p, strict=True))
    )
    if found:
        draft.model["families"] = [*draft.model.get("families", ()), *found]
    if updated.refine is not None:
        draft.model.update(refine=updated.refine, solid=updated.solid)
    _damping(draft, values, updated)
    _recordings(draft, updated.faults, channels, updated.pairs)
    _update(draft, model, spec)
    title = f"{spec.title or spec.name} (updated by {command})"
    rest = {k: v for k, v in draft.tables.items() if k != "title"}
    tables = compacted({"title": title, **rest})
    origin = "" if spec.path == UNNAMED else f" from {spec.shown}"
    head = (f"Written by cvxupdate {command}{origin}.", *says)
    if "update" in tables and check_text(to_toml(tables, head), spec.path):
        tables = {k: v for k, v in tables.items() if k not in NOT_KEPT}
        head = (*head, "The [update] of that file does not fit this model, so it was left out.")
    return Written(tables, head)


def _damping(draft: Draft, values: Sequence[Mapping[str, Any]], updated: Updated) -> None:
    model, zeta, alpha = updated.model, updated.zeta, updated.alpha
    rate = max(
        (
            float(np.real(v))
            for b, now in zip(model.blocks, values, strict=True)
            if any(t.matrix == "M" for t in b.terms)
            for v in now["alpha"]
        ),
        default=0.0,
    )  # one for the whole structure: a lump that was added behind it has it too
    if zeta is None:
        if alpha is not None:
            draft.model["damping"] = {"kind": "rayleigh", "alpha": alpha}
        elif rate > 0.0:
            _beside(draft, rate)
        return
    for material in draft.model.get("materials", {}).values():
        material.pop("eta", None)
    ratios = [max(float(z), 0.0) for z in zeta]
    while len(ratios) > 1 and ratios[-1] == ratios[-2]:
        ratios.pop()
    table = {"kind": "modal", "zeta": ratios if len(ratios) > 1 else (ratios or [0.0])[0]}
    beside = {"alpha": rate, "hysteretic": updated.hysteretic}
    draft.model["damping"] = table | {k: v for k, v in beside.items() if v > 0.0}


def _beside(draft: Draft, rate: float) -> None:
    """Mass-proportional damping beside the file's; where that is a loss factor, it goes to the
    elements."""
    old = draft.model.get("damping")
    if old is None or old["kind"] == "rayleigh":
        draft.model["damping"] = {
            "kind": "rayleigh",
            **(old or {}),
            "alpha": rate + (old or {}).get("alpha", 0.0),
        }
    elif old["kind"] == "modal":
        draft.model["damping"] = {**old, "alpha": rate}
    else:
        lossy = {kind.name for kind in ELEMENTS.members() if "eta" in kind.text.changes}
        for block in draft.model["elements"]:
            for row in block["rows"] if block["type"] in lossy else ():
                row.setdefault("eta", _material_loss(draft, row, old["eta"]))
        draft.model["damping"] = {"kind": "rayleigh", "alpha": rate}


def _material_loss(draft: Draft, row: Mapping[str, Any], otherwise: float) -> float:
    return float(
        draft.model.get("materials", {}).get(row.get("material"), {}).get("eta", otherwise)
    )


def _recordings(
    draft: Draft,
    faults: Sequence[tuple[Fault, float]],
    channels: Sequence[frozenset[str]],
    pairs: Mapping[int, Sequence[int]],
) -> None:
    """Faults are taken out in the order opposite to that in which they act; what a recording does
    not have is not taken out of it."""
    for number, recording in enumerate(draft.tables.get("recordings", ())):
        has = channels[number] if number < len(channels) else frozenset()
        corrections = [
            row for fault, value in reversed(faults) for row in fault.corrections(value, has)
        ]
        if corrections and recording["kind"] != "modes":
            recording["corrections"] = [*recording.get("corrections", ()), *corrections]
        for row, mode in zip(recording.get("rows", ()), pairs.get(number, ()), strict=False):
            if "mode" in row:
                row.pop("mode")
                if mode > 0:
                    row["mode"] = mode


def _labels(recordings: Sequence[Recording]) -> list[frozenset[str]]:
    return [
        frozenset(
            named(c.label, c.quantity)
            for c in (
                (*r.responses, *r.references) if isinstance(r, FrequencyResponse) else r.channels
            )
        )
        for r in recordings
    ]


def _update(draft: Draft, model: Model, spec: Spec) -> None:
    """Where the file has no [update]: one for what was found, so that `run` can sharpen it."""
    kinds = {r.kind for r in spec.recordings if r.use == "fit"}
    if (
        spec.update is not None
        or not kinds
        or any(b.kind.name == "gyroscopic" for b in model.blocks)
        or is_nonlinear(model)
    ):
        return
    rows: list[dict[str, Any]] = []
    for q in model.parameters:
        if q.group is not None:
            continue
        placed = [
            draft.known.get((i, q.of), (i, {"shear": "kappa"}.get(q.of, q.of))) for i in q.elements
        ]
        key = placed[0][1] if placed else q.of
        rows.append(
            {
                **({"elements": [i for i, _ in placed]} if placed else {}),
                "of": key,
                "name": f"found {len(rows) + 1}: {key}",
            }
        )
    if rows:
        draft.tables["update"] = {
            **({"method": "frequencies"} if kinds == {"modes"} else SHARPEN),
            "parameters": rows,
        }
