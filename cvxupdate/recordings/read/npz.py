"""NumPy's NPZ (and NPY). Pickled objects are never loaded: they can run code."""

from __future__ import annotations

import io
import math
import mmap
import struct
import zipfile
import zlib
from pathlib import Path
from typing import IO

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options, Progress
from cvxupdate.recordings.read.disk_buffer import PIECE, DiskBuffer
from cvxupdate.unpacking import must_be_believable

_LIMIT = 2**34  # bytes of one array that are believed without a second thought: 16 GB
_HEADER = (
    2**16
)  # bytes that hold any NPY header of version 1, and any of version 2 that numpy writes


def _header(stream: IO[bytes], where: str) -> tuple[tuple[int, ...], bool, np.dtype[np.generic]]:
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    elif version == (2, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_2_0(stream)
    else:
        raise RecordingError(
            f"{where}: NPY version {version} is not supported. Save it again with numpy.save."
        )
    return shape, fortran, dtype


def _array(
    stream: IO[bytes], size: int, where: str, view: mmap.mmap | memoryview | None, offset: int
) -> AnyArray | None:
    """One NPY stream of ``size`` bytes; ``view`` and ``offset`` give a view of the disk when the
    member is not compressed."""
    shape, fortran, dtype = _header(stream, where)
    if dtype.hasobject:
        return None
    count = math.prod(shape)
    begin = stream.tell()
    if any(n < 0 for n in shape) or count * dtype.itemsize > min(_LIMIT, size - begin):
        raise RecordingError(
            f"{where}: its header declares {shape} values of {dtype}, more than the file holds. "
            "The file is cut short or damaged: copy or export it again."
        )
    if view is not None:
        flat: AnyArray = np.frombuffer(view, dtype, count, offset + begin)
    else:
        flat = np.frombuffer(stream.read(count * dtype.itemsize), dtype, count)
    return flat.reshape(shape, order="F" if fortran else "C")


def _unpacked(
    stream: IO[bytes], member: zipfile.ZipInfo, where: str, progress: Progress | None
) -> AnyArray | None:
    """A compressed member; a large one is unpacked to disk. The archive checks its own sum when the
    end is reached."""
    must_be_believable(member.compress_size, member.file_size, where)
    if member.file_size <= PIECE:
        array = _array(stream, member.file_size, where, None, 0)
        stream.read()
        return array
    buffer = DiskBuffer(where)
    while piece := stream.read(PIECE):
        buffer.add(piece)
        if progress is not None:
            progress(
                f"unpacking {member.filename}", buffer.size, max(member.file_size, buffer.size)
            )
    view = buffer.view()
    return _array(io.BytesIO(view[:_HEADER]), buffer.size, where, view, 0)


def _stored_at(path: Path, member: zipfile.ZipInfo) -> int:
    """Offset of an uncompressed member's bytes in the archive (its local header may differ from the
    directory's)."""
    with path.open("rb") as file:
        file.seek(member.header_offset)
        head = file.read(30)
    name, extra = struct.unpack("<HH", head[26:30])
    return int(member.header_offset) + 30 + int(name) + int(extra)


def _sound(path: Path, start: int, member: zipfile.ZipInfo, progress: Progress | None) -> bool:
    """Whether an uncompressed member agrees with its checksum; read in pieces, so that a large one
    stays on disk."""
    total, left = 0, member.file_size
    with path.open("rb") as file:
        file.seek(start)
        while left > 0 and (piece := file.read(min(2**22, left))):
            total, left = zlib.crc32(piece, total), left - len(piece)
            if progress is not None and member.file_size > PIECE:
                progress(f"reading {path.name}", member.file_size - left, member.file_size)
    return total == member.CRC


def read_npz(path: Path, options: Options) -> Contents:
    """Every numeric array of an NPZ or NPY file; uncompressed arrays stay on disk until they are
    used.

    Raises `RecordingError` when the archive is damaged; arrays of Python objects are left out with
    a note.
    """
    arrays: dict[str, AnyArray] = {}
    notes: list[str] = []
    if path.suffix.lower() == ".npy":
        with path.open("rb") as file:
            only = _array(
                file,
                path.stat().st_size,
                str(path),
                mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ),
                0,
            )
        if only is None:
            raise RecordingError(
                f"{path}: holds pickled Python objects, which are never loaded. Save a "
                "numeric array."
            )
        return Contents(str(path), "npy", {"data": only})
    with zipfile.ZipFile(path) as archive, path.open("rb") as file:
        # the view is not closed here: the arrays are slices of it
        view = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            where = f"{path}: array {name!r}"
            if not member.filename.endswith(".npy") or (
                options.only is not None and name not in options.only
            ):
                continue
            stored = member.compress_type == zipfile.ZIP_STORED
            with archive.open(member) as stream:
                if stored:
                    array = _array(stream, member.file_size, where, view, _stored_at(path, member))
                else:
                    array = _unpacked(stream, member, where, options.progress)
            if stored and not _sound(path, _stored_at(path, member), member, options.progress):
                raise RecordingError(
                    f"{where}: checksum mismatch. The file is damaged: copy or export it again."
                )
            if array is None or array.dtype.kind not in "biufcUS":
                notes.append(
                    f"array {name!r} holds Python objects, which are never loaded; it was left out"
                )
                continue
            arrays[name] = array
    return Contents(str(path), "npz", arrays, notes=tuple(notes))


NPZ = Format(
    "npz",
    (".npz", ".npy"),
    lambda head: head.startswith((b"PK\x03\x04", b"\x93NUMPY")),
    read_npz,
    disguised="refused",
)
