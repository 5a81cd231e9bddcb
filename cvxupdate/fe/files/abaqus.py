"""``.mtx``: Matrix Market, or what Abaqus writes under that ending (``*MATRIX GENERATE`` with
``*MATRIX OUTPUT``): node, direction, node, direction, value; or row, column, value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.found import Found, mirrored, of_labels

NAME = "matrix"


def read_mtx(path: Path) -> Found:
    """The one matrix of the file.

    Raises
    ------
    ModelError
        When it is neither of the two.
    """
    with path.open("rb") as file:
        market = file.read(14) == b"%%MatrixMarket"
    if market:
        from scipy.io import mmread

        return Found({NAME: sp.csr_array(mmread(path))})
    lines = path.read_text(encoding="latin-1").splitlines()
    kept = [line for line in lines if line.strip() and not line.lstrip().startswith("*")]
    if not kept:
        raise ModelError(f"{path}: holds no matrix.")
    comma = "," in kept[0]
    table = np.loadtxt(
        [line.rstrip().rstrip(",") for line in kept] if comma else kept,
        delimiter="," if comma else None,
        ndmin=2,
    )
    if table.shape[1] == 5:
        ends = [table[:, k].astype(np.int64) for k in range(4)]
        A, labels, held = of_labels(path, ends, table[:, 4], symmetric=True)
        return Found({NAME: A}, {NAME: labels}, held)
    if table.shape[1] != 3:
        raise ModelError(
            f"{path}: is neither Matrix Market nor a matrix of Abaqus (3 or 5 columns; it has "
            f"{table.shape[1]})."
        )
    rows, columns = (table[:, k].astype(np.int64) - 1 for k in (0, 1))
    if min(rows.min(), columns.min()) < 0:
        raise ModelError(f"{path}: rows and columns are counted from 1.")
    size = int(max(rows.max(), columns.max())) + 1
    return Found({NAME: mirrored(rows, columns, table[:, 2], size)})
