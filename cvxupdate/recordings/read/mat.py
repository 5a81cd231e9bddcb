"""MATLAB 4 to 7.2 files; 7.3 is HDF5 (see `hdf5`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.recordings.read.contents import AnyArray, Contents, Options


def _flatten(name: str, value: Any, arrays: dict[str, AnyArray], notes: list[str], depth: int = 0) -> None:
    """Numeric arrays of a value; the fields of a 1 x 1 struct become ``struct.field``, sparse matrices become dense."""
    if hasattr(value, "toarray"):
        value = value.toarray()
    if not isinstance(value, np.ndarray):
        value = np.asarray(value)
    if value.dtype.names is not None and value.size == 1 and depth < 8:
        for key in value.dtype.names:
            _flatten(f"{name}.{key}", value[key].item(), arrays, notes, depth + 1)
    elif value.dtype.kind in "biufc":
        arrays[name] = value
    elif value.dtype.kind != "U":
        notes.append(f"variable {name!r} is not a numeric array; it was left out")


def read_mat(path: Path, options: Options) -> Contents:
    """Every numeric variable of a MATLAB 5 file (or 4), 2-D as MATLAB has it; a damaged file raises `RecordingError`."""
    from scipy.io import loadmat

    wanted = None if options.only is None else sorted({name.split(".")[0] for name in options.only})
    arrays: dict[str, AnyArray] = {}
    notes: list[str] = []
    for name, value in loadmat(path, variable_names=wanted).items():
        if not name.startswith("__"):
            _flatten(name, value, arrays, notes)
    return Contents(str(path), "mat", arrays, notes=tuple(notes))
