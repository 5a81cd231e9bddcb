"""Inspection of a container that holds a frequency axis and FRFs on it, by whatever names."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cvxupdate.recordings.inspect.block import recordings_block
from cvxupdate.recordings.inspect.channels import Column, channel_views
from cvxupdate.recordings.inspect.functions import frf_findings
from cvxupdate.recordings.inspect.result import Inspection
from cvxupdate.recordings.read.contents import Contents, Progress
from cvxupdate.recordings.read.time_axis import rises

_FREQUENCY = re.compile(r"(.*[./])?(f|fr|freq\w*|frequenc\w*|hz|f_?axis)", re.IGNORECASE)
_FRF = re.compile(
    r"(.*[./])?(h\d*|frfs?\w*|tf|transfer\w*|mobility|receptance|accelerance)", re.IGNORECASE
)
KINDS = ("x", "y", "z", "rx", "ry", "rz")
_SHOWN = 64  # functions that are shown
_FEW = 400  # responses that a block lists


def frf_names(contents: Contents) -> tuple[str, str] | None:
    """The names of the frequency axis and of the FRFs (lines first); None where there are none."""
    for axis, values in contents.arrays.items():
        flat = np.squeeze(values)
        if not _FREQUENCY.fullmatch(axis) or flat.ndim != 1 or flat.dtype.kind not in "iuf":
            continue
        if len(flat) < 2 or not rises(flat):
            continue
        fits = [
            name
            for name, a in contents.arrays.items()
            if name != axis and 0 < a.ndim <= 3 and a.shape[0] == len(flat)
        ]
        complex_ = [n for n in fits if contents.arrays[n].dtype.kind == "c"]
        named = [n for n in complex_ or fits if _FRF.fullmatch(n)]
        for found in (named, complex_):
            if found:
                return axis, found[0]
    return None


def _places(contents: Contents, shape: tuple[int, ...]) -> list[str]:
    """Where each function was measured and driven, in the order of the flattened array; none where
    the file does not say."""
    sides = []
    for side, many in zip(("response", "reference"), (*shape, 1, 1)[1:3], strict=True):
        known = [contents.arrays.get(f"{side}_{key}") for key in ("node", "dof")]
        if any(a is None or np.size(a) != many for a in known):
            return []
        nodes, dofs = (np.ravel(np.asarray(a)).tolist() for a in known)
        sides.append([f"n{n:.0f}.{_dof(d)}" for n, d in zip(nodes, dofs, strict=True)])
    return [f"{a} / {b}" for a in sides[0] for b in sides[1]]


def _dof(code: object) -> str:
    """A direction by its name or its number, 1 to 6."""
    if isinstance(code, int | float) and 1 <= code <= len(KINDS):
        return KINDS[int(code) - 1]
    return str(code).strip().lower()


def inspect_arrays(
    path: Path, contents: Contents, names: tuple[str, str], progress: Progress | None
) -> Inspection:
    """The FRFs of a container; up to 64 functions are shown."""
    axis, name = names
    H = contents.arrays[name]
    findings, notes = frf_findings(contents, "acceleration") if name == "H" else ((), ())
    flat = H.reshape(len(H), -1)
    places = _places(contents, H.shape)
    columns = [
        Column(f"{name} {k}", "", "acceleration", flat[:, k], places[k] if places else "")
        for k in range(min(flat.shape[1], _SHOWN))
    ]
    lines = ['response = "acceleration"']
    if (axis, name) != ("frequency", "H"):
        lines.append(f'variables = {{ frequency = "{axis}", H = "{name}" }}')
    if not {"response_node", "response_dof"} <= set(contents.arrays):
        responses, references = (*H.shape, 1, 1)[1:3]
        lines += ["channels = [   # node and dof of each response"]
        lines += [
            f'  {{ column = {k}, quantity = "acceleration", node = {k + 1}, dof = "z" }},'
            for k in range(min(responses, _FEW))
        ]
        lines += ["]", "references = [   # where it was excited"]
        lines += [f'  {{ node = {k + 1}, dof = "z" }},' for k in range(references)] + ["]"]
    return Inspection(
        str(path),
        contents.format,
        "frf",
        float("nan"),
        len(H),
        channel_views(columns, float("nan"), progress),
        findings,
        (*contents.notes, *notes),
        recordings_block(path, "frf", lines),
    )
