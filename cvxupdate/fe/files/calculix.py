"""CalculiX, ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: one triangle in job.sti and job.mas, the rows in
job.dof as node.direction."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.found import Found, Label, mirrored


def read_calculix(path: Path) -> Found:
    """The matrix of a .sti or .mas file; its name is its ending.

    Raises
    ------
    ModelError
        When job.dof is missing or does not fit.
    """
    beside = path.with_suffix(".dof")
    if not beside.is_file():
        raise ModelError(
            f"{path}: {beside.name}, which says the node and direction of each row, is not beside "
            "it. CalculiX writes both; copy it there."
        )
    labels = _labels(beside)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of an empty file, said below
        entries = np.loadtxt(path, ndmin=2)
    if entries.shape[1:] != (3,):
        raise ModelError(
            f"{path}: is no matrix of CalculiX: three columns are expected, row, column, value."
        )
    rows, columns = (entries[:, k].astype(np.int64) - 1 for k in (0, 1))
    top = max(rows.max(), columns.max()) + 1
    if top != len(labels) or min(rows.min(), columns.min()) < 0:
        raise ModelError(
            f"{path}: has {top} rows, {beside.name} {len(labels)}. They are of different runs, or "
            "one is cut short: export both again."
        )
    name = path.suffix.lower().lstrip(".")
    return Found({name: mirrored(rows, columns, entries[:, 2], len(labels))}, {name: labels})


def _labels(path: Path) -> tuple[Label, ...]:
    out = []
    for number, line in enumerate(path.read_text(encoding="ascii", errors="replace").split(), 1):
        node, dot, direction = line.partition(".")
        known = dot and node.isdigit() and direction in ("1", "2", "3", "4", "5", "6")
        if not known:
            raise ModelError(f"{path}: line {number}, {line!r}, is no node.direction.")
        out.append((int(node), int(direction) - 1))
    return tuple(out)
