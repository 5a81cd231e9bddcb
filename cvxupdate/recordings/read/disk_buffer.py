"""Records that do not fit into memory: a buffer on disk, and mapped pages released after use."""

from __future__ import annotations

import mmap
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray

PIECE = 2**24
"""Bytes between two reports, and between two releases of mapped pages."""


class DiskBuffer:
    """Bytes written to a temporary file that has no name, and read back as a mapped array: memory
    holds only what is looked at."""

    def __init__(self, where: Path | str) -> None:
        self._where = str(where)
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the arrays that are mapped from it
        self.size = 0

    def add(self, piece: bytes | memoryview | AnyArray) -> None:
        """Append bytes, or the numbers of an array in C order. Raises `RecordingError` when the
        disk is full."""
        data = (
            np.ascontiguousarray(piece).reshape(-1).view(np.uint8).data
            if isinstance(piece, np.ndarray)
            else piece
        )
        try:
            self._file.write(data)
        except OSError as error:
            raise RecordingError(
                f"{self._where}: no space for temporary files "
                f"({error.strerror or error}). Free some space, or set TMPDIR to a folder "
                "that has it."
            ) from error
        self.size += len(data)

    def view(self) -> memoryview:
        """All of it, mapped."""
        self._file.flush()
        return memoryview(
            mmap.mmap(self._file.fileno(), self.size, access=mmap.ACCESS_READ) if self.size else b""
        )


def release(*arrays: AnyArray | memoryview) -> None:
    """Give back the memory of arrays that are views of a mapped file: their pages stay on disk and
    come again when they are read."""
    if sys.platform == "win32":  # has no such call, and takes the pages back when it needs them
        return
    maps = {id(found): found for array in arrays for found in _maps(array)}
    for found in maps.values():
        found.madvise(mmap.MADV_DONTNEED)


def _maps(owner: Any) -> Iterator[mmap.mmap]:
    while owner is not None:
        if isinstance(owner, mmap.mmap):
            yield owner
            return
        owner = (
            owner.obj
            if isinstance(owner, memoryview)
            else owner.base
            if isinstance(owner, np.ndarray)
            else None
        )
