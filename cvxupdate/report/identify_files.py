"""The files of `identify`: result.json, tables of modes, a [[recordings]] block, the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.as_json import dumps, plain
from cvxupdate.report.identify_page import identify_page
from cvxupdate.report.identify_table import block, damping_block, measured_damping_files, modes_csv

if TYPE_CHECKING:
    from cvxupdate.commands.identified import Identified, ModeSetResult


def identify_files(found: Identified) -> tuple[dict[str, str], str]:
    """Files by name, and the JSON text by itself."""
    text = dumps(identify_data(found))
    files = {"result.json": text, "report.html": identify_page(found)}
    for s in found.sets:
        files[s.file] = modes_csv(s)
        files |= measured_damping_files(s)
    blocks = [damping_block(s) for s in found.sets]
    if any(blocks):
        files["damping.toml"] = "\n".join(b for b in blocks if b)
    files["recordings.toml"] = "\n".join(block(s) for s in found.sets)
    return files, text


def identify_data(found: Identified) -> dict[str, Any]:
    """Everything but curves, as plain data."""
    made: dict[str, Any] = plain(
        {
            "problem": found.problem,
            "status": "converged",
            "reason": "modes were identified from the recordings",
            "method": "identify",
            "time": found.time,
            "title": found.title,
            "path": found.path,
            "options": found.options,
            "sets": [_set(s) for s in found.sets],
            "skipped": found.skipped,
            "notes": found.notes,
        }
    )
    return made


def _set(s: ModeSetResult) -> dict[str, Any]:
    d = s.diagram
    return {
        "recording": s.recording,
        "kind": s.kind,
        "method": s.method,
        "band": s.band,
        "file": s.file,
        "quantity": s.quantity,
        "channels": s.labels,
        "modes": [
            {**vars(m), "shape": shape, "shape_std": std}
            for m, shape, std in zip(s.modes, s.shapes, s.shape_std, strict=True)
        ],
        "auto_mac": s.auto_mac,
        "stabilisation": None
        if d is None
        else {"order": d.order, "frequency": d.frequency, "damping": d.damping, "stable": d.stable},
        "rest": None if s.fit is None else s.fit.rest,
        "damping_law": None
        if s.laws is None
        else {k: v for k, v in vars(s.laws).items() if k != "outliers"},
        "normal": [vars(n) for n in s.normal],
        "block": block(s),
        "initial_damping": None if s.initial is None else vars(s.initial),
        "measured_damping": None
        if s.measured is None
        else {k: getattr(s.measured, k) for k in ("frequency", "zeta", "coupling")},
        "notes": s.notes,
    }
