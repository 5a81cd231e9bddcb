"""The diagnosed model as a problem file: what was found stands in it as elements, sections, factors
and corrections, ready to run again.

``of_fit`` writes what a fit of responses ended at, ``of_modes`` what one of mode tables did; both
end in `problem_text`, which needs only the file that was diagnosed and the model with the values of
its parameters. The matrices of the file built anew are those of the diagnosis: ordinary parameters
are factors on elements, a changed section is a section of its own, an opened joint two tied nodes
and a spring, a hidden oscillator a node of its own. What cannot be written down is the correction
for the mesh: the file's frequencies are those of the analyst's mesh (`cvxupdate.diagnose.refine`
writes it on a finer one).
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.physics import writers
from cvxupdate.physics.draft import Draft, change, draft_of
from cvxupdate.physics.fault import Fault
from cvxupdate.spec import Spec, check_problem
from cvxupdate.spec.write import compacted, to_toml

if TYPE_CHECKING:
    from cvxupdate.diagnose.fit import Fit
    from cvxupdate.diagnose.residual import ResponsePoint
    from cvxupdate.recordings.types import Recording
    from cvxupdate.residual.modal import ModalPoint


# element types with a loss factor
ELASTIC = ("spring", "rod", "beam2d", "beam3d", "plate", "matrix")


def of_fit(
    spec: Spec, recordings: Sequence[Recording], found: Fit, says: Sequence[str] = ()
) -> str | None:
    """The text of what a fit of responses ended at, ``recordings`` in the order of the file; None
    where the grammar has no word for it."""
    try:
        return of_point(spec, recordings, found.point, says)
    except ModelError:
        return None


def of_point(
    spec: Spec, recordings: Sequence[Recording], point: ResponsePoint, says: Sequence[str] = ()
) -> str:
    """The text of a model with its own damping ratio for every mode, and the faults of the
    sensors."""
    setting = point.setting
    faults = list(zip(setting.faults, (float(v) for v in point.fault_values), strict=True))
    notes = []
    if setting.mesh is not None and np.any(np.abs(setting.mesh) > 1e-6):
        shift = 100.0 * float(np.abs(setting.mesh).max())
        notes = [
            f"The diagnosis took out what the mesh shifts the frequencies (up to {shift:.2g} "
            "%); this file has them with it."
        ]
    n = len(setting.model.parameters)
    return problem_text(
        spec,
        setting.model,
        point.p[:n],
        zeta=point.damping[point.modes.rigid :],
        faults=faults,
        channels=_labels(recordings),
        says=(*says, *notes),
    )


def of_modes(
    spec: Spec,
    point: ModalPoint,
    says: Sequence[str] = (),
    alpha: float | None = None,
    damped: tuple[Model, np.ndarray] | None = None,
) -> str | None:
    """The text of what a fit of mode tables ended at; None where the grammar has no word for it.

    ``alpha`` (1/s) is a decay rate that all modes share: it takes the place of the file's damping;
    ``damped`` the model with a word of damping beside it, and its parameters.
    """
    order = [
        k
        for use in (True, False)
        for k, r in enumerate(spec.recordings)
        if r.kind == "modes" and (r.use == "fit") == use
    ]
    pairs = {
        k: [int(at) - point.modes.rigid + 1 if at >= 0 else 0 for at in places]
        for k, places in zip(order, point.places, strict=False)
    }
    model, p = damped or (point.residual.model, point.p)
    try:
        return problem_text(spec, model, p, alpha=alpha, pairs=pairs, says=says)
    except ModelError:
        return None


def problem_text(
    spec: Spec,
    model: Model,
    p: Sequence[float] | np.ndarray,
    *,
    zeta: Sequence[float] | np.ndarray | None = None,
    alpha: float | None = None,
    faults: Sequence[tuple[Fault, float]] = (),
    channels: Sequence[frozenset[str]] = (),
    pairs: Mapping[int, Sequence[int]] | None = None,
    says: Sequence[str] = (),
) -> str:
    """A problem file of ``model`` at the parameters ``p``.

    ``zeta`` (flexible modes,) fractions of critical beside what dashpots and loss factors of
    ``model`` give (None: the damping of ``spec`` stays); ``faults`` with their unknowns, in the
    order in which they act, and ``channels``, the labels of each recording that may have them;
    ``pairs`` recording → the flexible mode of each row, for tables that fix their pairing; ``says``
    goes into the comment on top. An [update] of the file is kept where it still holds; where there
    was none, one for what was found is written.

    Raises
    ------
    ModelError
        For an element that the grammar has no word for, or a property below zero that cannot be.
    """
    draft, written = draft_of(spec, model), writers()
    values = model.properties(p)
    for block, now in zip(model.blocks, values, strict=True):
        for e, number in enumerate(block.ids.tolist()):
            here = {k: float(np.real(v[e])) for k, v in now.items()}
            if number in draft.rows:
                change(draft, model, block, e, here, zeta is not None)
            elif block.kind.name in written:
                written[block.kind.name](draft, model, block, e, here)
            else:
                what = f"the diagnosis added a {block.kind.name} element"
                raise ModelError(f"{what}, which a problem file has no word for.")
    _damping(draft, model, values, zeta, alpha)
    _recordings(draft, faults, channels, pairs or {})
    _update(draft, model, spec)
    title = draft.tables.get("title", "")
    tables = compacted(
        {
            "title": f"{title} (updated by diagnose)".strip(),
            **{k: v for k, v in draft.tables.items() if k != "title"},
        }
    )
    head = [f"Written by cvxupdate diagnose from {spec.path}.", *says]
    text = to_toml(tables, head)
    if "update" in tables and _faulty(text):
        kept = {
            k: v for k, v in tables.items() if k not in ("update", "constraints", "regularisation")
        }
        text = to_toml(
            kept,
            [
                *head,
                "The [update] of that file does not fit this model any more, so it was left out.",
            ],
        )
    return text


def _damping(
    draft: Draft,
    model: Model,
    values: Sequence[Mapping[str, Any]],
    zeta: Sequence[float] | np.ndarray | None,
    alpha: float | None,
) -> None:
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
    draft.model["damping"] = table | ({"alpha": rate} if rate > 0.0 else {})


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
        for block in draft.model["elements"]:
            for row in block["rows"] if block["type"] in ELASTIC else ():
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
            fault.correction(value)
            for fault, value in reversed(faults)
            if {fault.channel, fault.other or fault.channel} <= has
        ]
        if corrections and recording["kind"] != "modes":
            recording["corrections"] = [*recording.get("corrections", ()), *corrections]
        for row, mode in zip(recording.get("rows", ()), pairs.get(number, ()), strict=False):
            if "mode" in row:
                row.pop("mode")
                if mode > 0:
                    row["mode"] = mode


def _labels(recordings: Sequence[Recording]) -> list[frozenset[str]]:
    from cvxupdate.recordings.types import FrequencyResponse

    return [
        frozenset(
            c.label
            for c in (r.responses if isinstance(r, FrequencyResponse) else r.channels)
            if c.quantity != "force"
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
            "method": "frequencies" if kinds == {"modes"} else "rfm",
            "parameters": rows,
        }


def _faulty(text: str) -> bool:
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return bool(check_problem(path))
