"""MATLAB 5 to 7.2 files (see `matfile`); 7.3 is HDF5 (see `hdf5`)."""

from __future__ import annotations

import math
import zlib
from pathlib import Path

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.matfile import Sparse, read_variables
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options, Progress
from cvxupdate.recordings.read.disk_buffer import PIECE, DiskBuffer, release
from cvxupdate.unpacking import must_be_believable

_MARKS = (b"\x00\x01IM", b"\x01\x00MI")
_DENSE = 10**8  # entries of a sparse matrix that is made dense


def _dense(sparse: Sparse, where: str) -> AnyArray:
    if math.prod(sparse.shape) > _DENSE:
        raise RecordingError(
            f"{where}: a sparse matrix of size {list(sparse.shape)} that cannot be made "
            "dense. Save it with full()."
        )
    dense = np.zeros(sparse.shape, dtype=sparse.values.dtype)
    counts = np.diff(sparse.ends, prepend=0)
    dense[sparse.rows, np.repeat(np.arange(sparse.shape[1]), counts)] = sparse.values
    return dense


def _unpacked(body: memoryview, where: str, progress: Progress | None) -> memoryview:
    """A compressed element; what is large goes to disk. `zlib.error` where the checksum, or
    anything else, is wrong."""
    if len(body) < PIECE // 1040:  # deflate packs by 1032 at most: it fits into memory
        return memoryview(zlib.decompress(body))
    unpacker, buffer, at = zlib.decompressobj(), DiskBuffer(where), 0
    while at < len(body) or unpacker.unconsumed_tail:
        packed = unpacker.unconsumed_tail or body[at : at + PIECE]
        at += 0 if unpacker.unconsumed_tail else len(packed)
        piece = unpacker.decompress(packed, PIECE)
        buffer.add(piece)
        must_be_believable(len(body), buffer.size, where)
        release(body)
        if not piece and unpacker.eof:
            break
        if progress is not None:
            progress(f"unpacking {Path(where).name}", at - len(unpacker.unconsumed_tail), len(body))
    if not unpacker.eof:
        raise RecordingError(
            f"{where}: one of its variables ends too early. The file is cut short or "
            "damaged: copy or save it again."
        )
    return buffer.view()


def read_mat(path: Path, options: Options) -> Contents:
    """Every numeric variable of a MATLAB 5 file, 2-D as MATLAB has it; ``struct.field`` for a 1 x 1
    struct. Damage raises `RecordingError`.

    Variables that are not compressed stay on disk until they are used; large compressed ones are
    unpacked to disk.
    """
    found = read_variables(
        path, options.only, lambda body, where: _unpacked(body, where, options.progress)
    )
    sparse = {
        name: _dense(matrix, f"{path}: variable {name!r}") for name, matrix in found.sparse.items()
    }
    return Contents(str(path), "mat", {**found.arrays, **sparse}, notes=tuple(found.notes))


MAT = Format(
    "mat",
    (".mat",),
    # 116 bytes of text stand first, which some writers leave blank; version and byte order count
    lambda head: head.startswith(b"MATLAB 5.0 MAT-file") or head[124:128] in _MARKS,
    read_mat,
    disguised="refused",
)
