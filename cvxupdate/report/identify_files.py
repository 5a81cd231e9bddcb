"""The files of `identify`: result.json, tables of modes, a [[recordings]] block, the page."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.as_json import dumps, plain

if TYPE_CHECKING:
    from cvxupdate.commands.identified import Identified, ModeSetResult

REAL = 1e-9
"""Imaginary parts below this are none."""


def identify_files(found: Identified) -> tuple[dict[str, str], str]:
    """Files by name, and the JSON text by itself."""
    from cvxupdate.report.identify_page import identify_page

    text = dumps(identify_data(found))
    files = {"result.json": text, "report.html": identify_page(found)}
    for s in found.sets:
        files[s.file] = modes_csv(s)
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
        "notes": s.notes,
    }


def _real(s: ModeSetResult) -> bool:
    return float(np.abs(s.shapes.imag).max(initial=0.0)) < REAL


def _columns(s: ModeSetResult) -> list[int]:
    """Channels that get a column: the first of each place."""
    return [k for k, label in enumerate(s.labels) if "(" not in label]


def _given(value: float) -> str:
    return (
        "" if not np.isfinite(value) else repr(float(f"{value:.10g}") + 0.0)
    )  # no minus before a zero


def modes_csv(s: ModeSetResult) -> str:
    """A table with a row for each mode: frequency, damping, deviations, and a column (or one for
    the real and one for the imaginary part) for each place; what is not known has no column."""
    columns = _columns(s)
    real = _real(s)
    head = ["frequency"]
    figures = [[m.frequency for m in s.modes]]
    for key in ("frequency_std", "damping", "damping_std"):
        values = [getattr(m, key) for m in s.modes]
        if np.all(np.isfinite(values)) and (key == "damping" or np.all(np.array(values) > 0.0)):
            head.append(key)
            figures.append(values)
    std = np.sqrt(np.mean(np.asarray(s.shape_std)[:, columns] ** 2, axis=1))
    if np.all(np.isfinite(std)) and np.all(std > 0.0):
        head.append("shape_std")
        figures.append(std.tolist())
    for k in columns:
        parts = (s.shapes[:, k].real,) if real else (s.shapes[:, k].real, s.shapes[:, k].imag)
        head += [s.labels[k]] if real else [f"{s.labels[k]} re", f"{s.labels[k]} im"]
        figures += [p.tolist() for p in parts]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_given(float(v)) for v in row] for row in zip(*figures, strict=True))
    return out.getvalue()


def block(s: ModeSetResult) -> str:
    """A [[recordings]] table that reads `modes_csv` beside the problem file."""
    ends = f"{s.band[0]:.4g} to {s.band[1]:.4g} Hz"
    lines = [
        f"# {len(s.modes)} modes by {s.method} from {s.recording}, {ends}".replace("\n", " "),
        "[[recordings]]",
        'kind = "modes"',
        'use = "fit"',
        f'file = "{s.file}"',
    ]
    if s.quantity in ("displacement", "velocity", "acceleration"):
        lines.append(f'response = "{s.quantity}"')
    return "\n".join(lines) + "\n"
