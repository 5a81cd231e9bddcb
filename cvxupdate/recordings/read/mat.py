"""MATLAB 5 to 7.2 files; 7.3 is HDF5 (see `hdf5`).

Read here rather than by scipy.io: its compiled reader ends the whole process on some damaged files (SciPy 1.17, found by the fuzz test).
Source: The MathWorks, MAT-File Format (2019), "Level 5 MAT-File Format". The tests compare with what scipy writes and reads.
"""

from __future__ import annotations

import math
import mmap
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Options, Told
from cvxupdate.recordings.read.disk import PIECE, Spool, release

_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_MATRIX, _COMPRESSED, _STRUCT, _SPARSE = 14, 15, 2, 5
_LARGEST = 2**34
_DENSE = 10**8  # entries of a sparse matrix that is made dense
_NESTED = 8

Buffer = bytes | memoryview


@dataclass(frozen=True)
class _Element:
    kind: int
    body: memoryview


def _elements(body: memoryview, order: str, where: str) -> Iterator[_Element]:
    """The data elements of a buffer, one behind the other; a length that leaves the buffer raises."""
    at = 0
    while at + 8 <= len(body):
        first, size = np.frombuffer(body, f"{order}u4", 2, at).tolist()
        if first >> 16:  # a small element: kind and length share a word, four bytes of data follow
            kind, size, start, step = first & 0xFFFF, first >> 16, at + 4, 8
            if size > 4:
                raise RecordingError(f"{where}: a small element of {size} bytes. The file is damaged: save it again.")
        else:
            kind, start = first, at + 8
            step = 8 + (size if kind == _COMPRESSED else 8 * math.ceil(size / 8))
        if start + size > len(body):
            raise RecordingError(f"{where}: an element of {size} bytes where {len(body) - start} are left. The file is cut short or damaged: "
                                 "copy or save it again.")
        yield _Element(kind, body[start : start + size])
        at += step


def _numbers(element: _Element, order: str, where: str) -> AnyArray:
    if element.kind not in _KINDS:
        raise RecordingError(f"{where}: data of type {element.kind}, which is not a number. The file is damaged: save it again.")
    dtype = np.dtype(order + _KINDS[element.kind])
    if len(element.body) % dtype.itemsize:
        raise RecordingError(f"{where}: {len(element.body)} bytes do not hold whole numbers. The file is damaged: save it again.")
    return np.frombuffer(element.body, dtype)


def _matrix(body: memoryview, order: str, where: str, name: str, arrays: dict[str, AnyArray], notes: list[str], depth: int = 0) -> None:
    """One matrix element into ``arrays``: dense, sparse (made dense), or the fields of a 1 x 1 struct."""
    parts = _elements(body, order, where)
    head = [next(parts, None) for _ in range(3)]
    if any(part is None for part in head):
        return  # an empty matrix element stands for []
    flags_part, dims_part, name_part = (part for part in head if part is not None)
    flags = _numbers(flags_part, order, where).astype(np.int64)
    dims = [int(n) for n in _numbers(dims_part, order, where)]
    if flags.size < 1 or len(dims) < 2 or any(n < 0 for n in dims) or math.prod(dims) > _LARGEST:
        raise RecordingError(f"{where}: a matrix of size {dims}. The file is damaged: save it again.")
    kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & 0x0800)
    own = bytes(name_part.body).decode("latin-1").rstrip("\0")
    name = name if depth else own
    where = f"{where.split(': variable')[0]}: variable {name!r}"
    if kind in _CLASSES:
        values = [_numbers(part, order, where) for part, _ in zip(parts, range(2 if is_complex else 1), strict=False)]
        if len(values) != (2 if is_complex else 1) or any(v.size != math.prod(dims) for v in values):
            raise RecordingError(f"{where}: it has {[v.size for v in values]} numbers for a size of {dims}. The file is damaged: save it again.")
        data = values[0] + 1j * values[1] if is_complex else values[0]
        native = np.dtype(_CLASSES[kind])
        if not is_complex and data.dtype.newbyteorder("=") != native:
            data = data.astype(native)  # MATLAB stores whole numbers in the smallest type that holds them
        arrays[name] = data.reshape(dims, order="F")
    elif kind == _SPARSE:
        arrays[name] = _sparse(list(parts), dims, is_complex, order, where)
    elif kind == _STRUCT and math.prod(dims) == 1 and depth < _NESTED:
        width_part, names_part = next(parts, None), next(parts, None)
        if width_part is None or names_part is None:
            raise RecordingError(f"{where}: its fields have no names. The file is damaged: save it again.")
        width = int(_numbers(width_part, order, where)[0])
        text = bytes(names_part.body)
        fields = [text[at : at + width].split(b"\0")[0].decode("latin-1") for at in range(0, len(text), width)] if 0 < width <= 64 else []
        for field, part in zip(fields, parts, strict=False):
            if part.kind == _MATRIX:
                _matrix(part.body, order, where, f"{name}.{field}", arrays, notes, depth + 1)
    elif kind != 4:  # text is no number, and needs no note
        notes.append(f"variable {name!r} is not a numeric array; it was left out")


def _sparse(parts: list[_Element], dims: list[int], is_complex: bool, order: str, where: str) -> AnyArray:
    """A sparse matrix as a dense one."""
    if len(parts) < (4 if is_complex else 3) or len(dims) != 2 or math.prod(dims) > _DENSE:
        raise RecordingError(f"{where}: a sparse matrix of size {dims} that cannot be made dense. Save it with full().")
    rows, starts, real = (_numbers(part, order, where) for part in parts[:3])
    values = real + 1j * _numbers(parts[3], order, where) if is_complex else real.astype(float)
    counts: NDArray[np.int64] = np.asarray(np.diff(starts.astype(np.int64)), dtype=np.int64)
    used = int(starts[-1]) if starts.size else -1
    if starts.size != dims[1] + 1 or starts[0] != 0 or np.any(counts < 0) or not 0 <= used <= min(rows.size, values.size):
        raise RecordingError(f"{where}: its columns are not in order. The file is damaged: save it again.")
    if used and (rows[:used].min() < 0 or rows[:used].max() >= dims[0]):
        raise RecordingError(f"{where}: an entry lies outside {dims}. The file is damaged: save it again.")
    dense = np.zeros(dims, dtype=values.dtype)
    dense[rows[:used], np.repeat(np.arange(dims[1]), counts)] = values[:used]
    return dense


def _name_of(body: memoryview, order: str, where: str) -> str:
    part = [element for element, _ in zip(_elements(body, order, where), range(3), strict=False)]
    return bytes(part[2].body).decode("latin-1") if len(part) == 3 else ""


def _unpacked(body: memoryview, where: str, told: Told | None) -> memoryview:
    """A compressed element; what is large goes to disk. `zlib.error` where the checksum, or anything else, is wrong."""
    if len(body) < PIECE // 16:
        return memoryview(zlib.decompress(body))
    unpacker, spool, at = zlib.decompressobj(), Spool(where), 0
    while at < len(body) or unpacker.unconsumed_tail:
        packed = unpacker.unconsumed_tail or body[at : at + PIECE]
        at += 0 if unpacker.unconsumed_tail else len(packed)
        piece = unpacker.decompress(packed, PIECE)
        spool.add(piece)
        release(body)
        if not piece and unpacker.eof:
            break
        if told is not None:
            told(f"unpacking {Path(where).name}", at - len(unpacker.unconsumed_tail), len(body))
    if not unpacker.eof:
        raise RecordingError(f"{where}: a variable of it ends before its time. The file is cut short or damaged: copy or save it again.")
    return spool.view()


def read_mat(path: Path, options: Options) -> Contents:
    """Every numeric variable of a MATLAB 5 file, 2-D as MATLAB has it; ``struct.field`` for a 1 x 1 struct. Damage raises `RecordingError`.

    Variables that are not compressed stay on disk until they are used; a compressed one carries a checksum, which is compared.
    """
    with path.open("rb") as file:
        view = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if len(view) < 128 or bytes(view[126:128]) not in (b"IM", b"MI"):
        raise RecordingError(f"{path}: its header is not that of a MATLAB 5 file (MATLAB 4 files are not read). Save it with -v7.")
    order = "<" if bytes(view[126:128]) == b"IM" else ">"
    arrays: dict[str, AnyArray] = {}
    notes: list[str] = []
    if (len(view) - 128) % 8 and len(view) < 136:
        raise RecordingError(f"{path}: it ends behind its header. The file is cut short: copy or save it again.")
    for element in _elements(view[128:], order, str(path)):
        body = element.body
        if element.kind == _COMPRESSED:
            inner = _unpacked(body, str(path), options.told)
            found = next(_elements(inner, order, str(path)), None)
            if found is None or found.kind != _MATRIX:
                continue
            body = found.body
        elif element.kind != _MATRIX:
            raise RecordingError(f"{path}: a data element of type {element.kind} where a variable is expected. The file is damaged: save it again.")
        if options.only is None or _name_of(body, order, str(path)) in {name.split(".")[0] for name in options.only}:
            _matrix(body, order, str(path), "", arrays, notes)
    if not arrays and not notes:
        raise RecordingError(f"{path}: it holds no variables. The file is cut short, or was saved empty.")
    return Contents(str(path), "mat", arrays, notes=tuple(notes))
