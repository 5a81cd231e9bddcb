"""Nastran's OUTPUT4, by pyyeti: text and binary, dense and sparse, of either byte order."""

from __future__ import annotations

from pathlib import Path

import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.found import Found


def read_op4(path: Path) -> Found:
    """Every matrix of the file, by name. OUTPUT4 knows no nodes: labels come from the problem file.

    Raises
    ------
    ModelError
        When pyyeti is not installed, or cannot read it.
    """
    try:
        from pyyeti.nastran import op4
    except ImportError:
        raise ModelError(
            f"{path}: OUTPUT4 files are read by pyyeti, which is not installed. Install it: pip "
            "install pyyeti; or export DMIG (.pch)."
        ) from None
    try:
        found = op4.OP4().listload(str(path), sparse=None)
    except Exception as error:  # it raises whatever its reading stumbles over
        raise ModelError(
            f"{path}: pyyeti cannot read it as OUTPUT4 ({type(error).__name__}). Export it again."
        ) from error
    names, matrices = found[0], found[1]
    if not names:
        raise ModelError(f"{path}: holds no matrix.")
    return Found({n.upper(): sp.csr_array(m) for n, m in zip(names, matrices, strict=True)})
