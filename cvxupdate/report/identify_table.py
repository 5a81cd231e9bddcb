"""Tables of modes as `identify` writes them, and the [[recordings]] table that reads them."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cvxupdate.commands.identified import ModeSetResult
    from cvxupdate.recordings.types import Real

REAL = 1e-9
"""Imaginary parts below this are none."""
PAIRING = ("mode", "model_mode")
"""The column of pairs: alone, and beside columns of places."""


def _real(s: ModeSetResult) -> bool:
    return float(np.abs(s.shapes.imag).max(initial=0.0)) < REAL


def _columns(s: ModeSetResult) -> list[int]:
    """Channels that get a column: the first of each place."""
    return [k for k, label in enumerate(s.labels) if "(" not in label and s.dofs[k]]


def _given(value: float, column: str) -> str:
    if not np.isfinite(value):
        return ""
    if column in PAIRING:
        return f"{value:.0f}"
    return repr(float(f"{value:.10g}") + 0.0)  # no minus before a zero


def modes_csv(s: ModeSetResult) -> str:
    """A table with a row for each mode: frequency, damping, deviations, and a column (or one for
    the real and one for the imaginary part) for each place; what is not known has no column. The
    mode of the model that a mode is paired with is ``mode``, beside places ``model_mode``, as
    there `mode` only counts."""
    columns = _columns(s)
    real = _real(s)
    head = ["frequency"]
    figures = [[m.frequency for m in s.modes]]
    if any(m.pair for m in s.modes):
        head.append(PAIRING[bool(columns)])
        figures.append([m.pair or np.nan for m in s.modes])
    for key in ("frequency_std", "damping", "damping_std"):
        values = [getattr(m, key) for m in s.modes]
        if np.all(np.isfinite(values)) and (key == "damping" or np.all(np.array(values) > 0.0)):
            head.append(key)
            figures.append(values)
    std = np.sqrt(np.mean(np.asarray(s.shape_std)[:, columns] ** 2, axis=1)) if columns else None
    if std is not None and np.all(np.isfinite(std)) and np.all(std > 0.0):
        head.append("shape_std")
        figures.append(std.tolist())
    for k in columns:
        parts = (s.shapes[:, k].real,) if real else (s.shapes[:, k].real, s.shapes[:, k].imag)
        head += [s.labels[k]] if real else [f"{s.labels[k]} re", f"{s.labels[k]} im"]
        figures += [p.tolist() for p in parts]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(
        [_given(float(v), name) for v, name in zip(row, head, strict=True)]
        for row in zip(*figures, strict=True)
    )
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


def measured_damping_files(s: ModeSetResult) -> dict[str, str]:
    """The damping matrices of the modes as matrix rows of a problem file, each with a file of its
    own; empty where there are none."""
    d = s.measured
    if d is None:
        return {}
    stem = s.file.removeprefix("modes").removesuffix(".csv")  # "" or "_2"
    names = [f"damping{stem}_mode{k}.mtx" for k in range(1, len(d.zeta) + 1)]
    labels = json.dumps(list(d.labels))
    lines = [
        f"# (3.44): C = 2 omega zeta (M phi)(M phi)^T of each of {s.recording}'s "
        f"{len(d.zeta)} modes,".replace("\n", " "),
        "# phi its measured shape on all DOFs, instead of a [model.damping] table. Two of the",
        f"# shapes are coupled in the mass by {d.coupling:.2g} at most. The ratios as parameters:",
        '# parameters = [{ group = "measured damping", of = "damping", each = "element" }]',
        "[[model.elements]]",
        'type = "matrix"',
        'group = "measured damping"',
        f"labels = {labels}",
        "rows = [",
    ]
    for k, name in enumerate(names):
        lines.append(
            f'  {{ id = {d.first + k}, damping = "{name}" }},'
            f"  # {d.frequency[k]:.5g} Hz, zeta {d.zeta[k]:.4g}"
        )
    out = {f"damping_measured{stem}.toml": "\n".join([*lines, "]", ""])}
    return out | {name: _rank_one(v) for name, v in zip(names, d.vectors, strict=True)}


def _rank_one(v: Real) -> str:
    """v vᵀ as Matrix Market text, its lower triangle."""
    i, j = np.tril_indices(len(v))
    keep = (v[i] != 0.0) & (v[j] != 0.0)
    i, j = i[keep], j[keep]
    entries = zip((i + 1).tolist(), (j + 1).tolist(), (v[i] * v[j]).tolist(), strict=True)
    head = f"%%MatrixMarket matrix coordinate real symmetric\n{len(v)} {len(v)} {len(i)}\n"
    return head + "".join(f"{a} {b} {c!r}\n" for a, b, c in entries)


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
