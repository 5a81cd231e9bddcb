"""HDF5, and MATLAB 7.3, which is HDF5 with the axes reversed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options, Progress
from cvxupdate.recordings.read.disk_buffer import PIECE, DiskBuffer
from cvxupdate.unpacking import must_be_believable


def _complex(value: AnyArray) -> AnyArray:
    """MATLAB (and others) write complex numbers as a compound of two fields, real and imag (or r
    and i)."""
    names = value.dtype.names
    if names is None:
        return value
    for real, imag in (("real", "imag"), ("r", "i")):
        if set(names) == {real, imag}:
            return np.asarray(value[real] + 1j * value[imag])
    return value


def _values(item: Any, where: str, progress: Progress | None) -> AnyArray:
    """The numbers of a data set; those of a large one go to disk by slices along its first axis."""
    if item.ndim == 0 or item.size * item.dtype.itemsize <= 4 * PIECE or item.dtype.kind == "V":
        return np.asarray(item[()])
    buffer = DiskBuffer(where)
    rows = max(1, PIECE // max(item.size // max(item.shape[0], 1) * item.dtype.itemsize, 1))
    if item.chunks is not None:
        rows = max(rows // item.chunks[0], 1) * item.chunks[0]  # a chunk is unpacked once
    for at in range(0, item.shape[0], rows):
        buffer.add(np.asarray(item[at : at + rows]))
        if progress is not None:
            progress(f"reading {item.name}", min(at + rows, item.shape[0]), item.shape[0])
    return np.asarray(np.frombuffer(buffer.view(), item.dtype, item.size).reshape(item.shape))


def read_hdf5(path: Path, options: Options) -> Contents:
    """Every numeric data set of an HDF5 file, by its path inside the file (``"run1/data"``); a rate
    attribute is kept.

    A file written by MATLAB (7.3) has its axes turned back. Raises `RecordingError` when the file
    is damaged or h5py is missing.
    """
    try:
        import h5py
    except ImportError as error:
        raise RecordingError(
            f"{path}: reading HDF5 needs h5py. Install it with: pip install 'cvxupdate[formats]'"
        ) from error

    arrays: dict[str, AnyArray] = {}
    notes: list[str] = []
    rate: float | None = None
    size = path.stat().st_size
    with h5py.File(path, "r") as file:
        found: list[tuple[str, Any]] = []
        # links are not followed out of the file, and a group that contains itself is visited once
        file.visititems(
            lambda name, item: (
                found.append((name, item)) if isinstance(item, h5py.Dataset) else None
            )
        )
        for name, item in found:
            if name.startswith("#refs#") or (options.only is not None and name not in options.only):
                continue
            matlab = "MATLAB_class" in item.attrs
            if item.dtype.kind not in "biufcV" or (
                item.dtype.kind == "V" and item.dtype.names is None
            ):
                notes.append(f"data set {name!r} does not hold numbers; it was left out")
                continue
            if item.external or item.is_virtual:
                notes.append(
                    f"data set {name!r} keeps its numbers in another file; it was left out"
                )
                continue
            # a damaged header may promise more than any compression could have stored
            bytes_ = math.prod(item.shape) * item.dtype.itemsize
            if bytes_ > 2000 * size:
                raise RecordingError(
                    f"{path}: data set {name!r} declares {item.shape} values, more than the "
                    "file can hold. The file is damaged: copy or export it again."
                )
            if "MATLAB_empty" in item.attrs:
                continue
            must_be_believable(item.id.get_storage_size(), bytes_, f"{path}: data set {name!r}")
            value = _complex(_values(item, f"{path}: data set {name!r}", options.progress))
            if value.dtype.kind not in "biufc":
                notes.append(f"data set {name!r} does not hold plain numbers; it was left out")
                continue
            arrays[name] = value.T if matlab else value
            for key in ("rate", "fs", "sampling_rate", "sample_rate"):
                stated = item.attrs.get(key, file.attrs.get(key))
                if rate is None and stated is not None and np.size(stated) == 1:
                    rate = float(np.asarray(stated).ravel()[0])
    return Contents(str(path), "hdf5", arrays, rate=rate, notes=tuple(notes))


HDF5 = Format(
    "hdf5",
    (".h5", ".hdf5", ".hdf", ".mat"),
    lambda head: b"\x89HDF\r\n\x1a\n" in head,
    read_hdf5,
    also=("h5",),
    disguised="refused",
)
