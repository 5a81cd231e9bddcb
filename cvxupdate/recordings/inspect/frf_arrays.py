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


def inspect_arrays(
    path: Path, contents: Contents, names: tuple[str, str], progress: Progress | None
) -> Inspection:
    """The FRFs of a container; up to 64 functions are shown."""
    axis, name = names
    H = contents.arrays[name]
    findings, notes = frf_findings(contents, "acceleration") if name == "H" else ((), ())
    flat = H.reshape(len(H), -1)
    columns = [
        Column(f"{name} {k}", "", "acceleration", flat[:, k])
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
