"""Tables of modes as `identify` writes them, and the [[recordings]] table that reads them."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cvxupdate.commands.identified import ModeSetResult

REAL = 1e-9
"""Imaginary parts below this are none."""


def _real(s: ModeSetResult) -> bool:
    return float(np.abs(s.shapes.imag).max(initial=0.0)) < REAL


def _columns(s: ModeSetResult) -> list[int]:
    """Channels that get a column: the first of each place."""
    return [k for k, label in enumerate(s.labels) if "(" not in label and s.dofs[k]]


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
    std = np.sqrt(np.mean(np.asarray(s.shape_std)[:, columns or [0]] ** 2, axis=1))
    if columns and np.all(np.isfinite(std)) and np.all(std > 0.0):
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


def damping_block(s: ModeSetResult) -> str:
    """A [model.damping] table that has the measured damping on the average, in three forms; empty
    where no ratio is known."""
    d = s.initial
    if d is None:
        return ""
    ratios = ", ".join(f"{z:.4g}" for z in d.zeta)
    return (
        f"# initial damping from the {len(d.zeta)} ratios of {s.recording}, one of three:\n"
        '[model.damping]\nkind = "rayleigh"        # in proportion to mass and stiffness\n'
        f"alpha = {d.alpha:.6g}\nbeta = {d.beta:.6g}\n\n"
        f'# kind = "structural"    # the same loss factor everywhere\n# eta = {d.eta:.6g}\n\n'
        f'# kind = "modal"         # each mode its own\n# zeta = [{ratios}]\n'
    ).replace("\r", " ")


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
