"""MATLAB 5 to 7.2 files, for matrices of models and for recordings alike; 7.3 is HDF5 (see
`recordings.read.hdf5`).

Read here rather than by scipy.io: its compiled reader ends the whole process on some damaged files
(SciPy 1.17, found by the fuzz test). Source: The MathWorks, MAT-File Format (2019), "Level 5
MAT-File Format". The tests compare with what scipy writes and reads.
"""

from __future__ import annotations

import math
import mmap
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.matfile.elements import COMPRESSED, AnyArray, Element, elements, numbers
from cvxupdate.unpacking import PLENTY, RATIO, must_be_believable

_CLASSES = {
    6: "f8",
    7: "f4",
    8: "i1",
    9: "u1",
    10: "i2",
    11: "u2",
    12: "i4",
    13: "u4",
    14: "i8",
    15: "u8",
}
_MATRIX, _CELL, _STRUCT, _TEXT, _SPARSE = 14, 1, 2, 4, 5
_LARGEST = 2**34
_NESTED = 8


@dataclass(frozen=True)
class Sparse:
    """A sparse matrix as MATLAB stores it: ``values`` at ``rows``, column by column; column k ends
    at ``ends[k]``."""

    shape: tuple[int, int]
    rows: NDArray[np.int64]
    ends: NDArray[np.int64]
    values: AnyArray


@dataclass(frozen=True)
class Variables:
    """What a file holds: dense arrays, sparse matrices, texts (rows of a char array, entries of a
    cell of them), and notes on the rest."""

    arrays: dict[str, AnyArray] = field(default_factory=dict)
    sparse: dict[str, Sparse] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def _matrix(
    body: memoryview, order: str, where: str, name: str, into: Variables, depth: int = 0
) -> None:
    """One matrix element into ``into``: dense, sparse, text, a cell of texts, or the fields of a 1
    x 1 struct."""
    parts = elements(body, order, where)
    head = [next(parts, None) for _ in range(3)]
    if any(part is None for part in head):
        return  # an empty matrix element stands for []
    flags_part, dims_part, name_part = (part for part in head if part is not None)
    flags = numbers(flags_part, order, where).astype(np.int64)
    dims = [int(n) for n in numbers(dims_part, order, where)]
    if flags.size < 1 or len(dims) < 2 or any(n < 0 for n in dims) or math.prod(dims) > _LARGEST:
        raise RecordingError(
            f"{where}: a matrix of size {dims}. The file is damaged: save it again."
        )
    kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & 0x0800)
    own = bytes(name_part.body).decode("latin-1").rstrip("\0")
    name = name if depth else own
    where = f"{where.split(': variable')[0]}: variable {name!r}"
    if kind in _CLASSES:
        into.arrays[name] = _dense(parts, dims, kind, is_complex, order, where)
    elif kind == _SPARSE:
        into.sparse[name] = _sparse(list(parts), dims, is_complex, order, where)
    elif kind == _STRUCT and math.prod(dims) == 1 and depth < _NESTED:
        for key, part in zip(_fields(parts, order, where), parts, strict=False):
            if part.kind == _MATRIX:
                _matrix(part.body, order, where, f"{name}.{key}", into, depth + 1)
    elif kind == _TEXT:
        into.texts[name] = _text(next(parts, None), dims, order, where)
    elif kind == _CELL and depth < _NESTED:
        _cell(list(parts), order, where, name, into, depth)
    else:
        into.notes.append(f"variable {name!r} is not a numeric array; it was left out")


def _dense(
    parts: Iterator[Element], dims: list[int], kind: int, is_complex: bool, order: str, where: str
) -> AnyArray:
    """A full matrix of numbers, in the type that MATLAB has it in."""
    count = 2 if is_complex else 1
    values = [numbers(part, order, where) for part, _ in zip(parts, range(count), strict=False)]
    if len(values) != count or any(v.size != math.prod(dims) for v in values):
        raise RecordingError(
            f"{where}: it has {[v.size for v in values]} numbers for a size of {dims}. "
            "The file is damaged: save it again."
        )
    data = values[0] + 1j * values[1] if is_complex else values[0]
    native = np.dtype(_CLASSES[kind])
    # MATLAB stores whole numbers in the smallest type that holds them
    if not is_complex and data.dtype.newbyteorder("=") != native:
        data = data.astype(native)
    return data.reshape(dims, order="F")


def _fields(parts: Iterator[Element], order: str, where: str) -> list[str]:
    """The names of a struct's fields; none where their width makes no sense."""
    width_part, names_part = next(parts, None), next(parts, None)
    if width_part is None or names_part is None:
        raise RecordingError(
            f"{where}: its fields have no names. The file is damaged: save it again."
        )
    width, text = int(numbers(width_part, order, where)[0]), bytes(names_part.body)
    if not 0 < width <= 64:
        return []
    return [
        text[at : at + width].split(b"\0")[0].decode("latin-1") for at in range(0, len(text), width)
    ]


def _text(part: Element | None, dims: list[int], order: str, where: str) -> tuple[str, ...]:
    """The rows of a char array; UTF-8 (16), UTF-16 (17), or numbers of characters."""
    if part is None or math.prod(dims) == 0:
        return ()
    if part.kind in (16, 17):
        letters = list(
            bytes(part.body).decode(
                "utf-8" if part.kind == 16 else "utf-16-le" if order == "<" else "utf-16-be",
                "replace",
            )
        )
    else:
        letters = [chr(int(n) & 0xFFFF) for n in numbers(part, order, where)]
    if len(dims) != 2 or len(letters) != math.prod(dims):
        raise RecordingError(
            f"{where}: it has {len(letters)} letters for a size of {dims}. The file is "
            "damaged: save it again."
        )
    return tuple("".join(letters[row :: dims[0]]).rstrip("\0 ") for row in range(dims[0]))


def _cell(
    parts: list[Element], order: str, where: str, name: str, into: Variables, depth: int
) -> None:
    """A cell array: one list of texts where it holds nothing else, else every entry under its name
    in MATLAB, ``K{1}``, ``K{2}`` … (counted down the columns)."""
    inner = Variables()
    for k, part in enumerate(parts):
        if part.kind == _MATRIX:
            _matrix(part.body, order, where, f"{name}{{{k + 1}}}", inner, depth + 1)
    lines = list(inner.texts.values())
    if len(lines) == len(parts) and all(len(line) == 1 for line in lines):
        into.texts[name] = tuple(line[0] for line in lines)
        return
    into.arrays.update(inner.arrays)
    into.sparse.update(inner.sparse)
    into.texts.update(inner.texts)
    into.notes.extend(inner.notes)


def _sparse(
    parts: list[Element], dims: list[int], is_complex: bool, order: str, where: str
) -> Sparse:
    if len(parts) < (4 if is_complex else 3) or len(dims) != 2:
        raise RecordingError(
            f"{where}: a sparse matrix of size {dims} without its parts. The file is damaged: "
            "save it again."
        )
    rows, starts, real = (numbers(part, order, where) for part in parts[:3])
    values = real + 1j * numbers(parts[3], order, where) if is_complex else real.astype(float)
    counts: NDArray[np.int64] = np.asarray(np.diff(starts.astype(np.int64)), dtype=np.int64)
    used = int(starts[-1]) if starts.size else -1
    if (
        starts.size != dims[1] + 1
        or starts[0] != 0
        or np.any(counts < 0)
        or not 0 <= used <= min(rows.size, values.size)
    ):
        raise RecordingError(
            f"{where}: its columns are not in order. The file is damaged: save it again."
        )
    if used and (rows[:used].min() < 0 or rows[:used].max() >= dims[0]):
        raise RecordingError(
            f"{where}: an entry lies outside {dims}. The file is damaged: save it again."
        )
    return Sparse(
        (dims[0], dims[1]), rows[:used].astype(np.int64), starts[1:].astype(np.int64), values[:used]
    )


def _name_of(body: memoryview, order: str, where: str) -> str:
    part = [element for element, _ in zip(elements(body, order, where), range(3), strict=False)]
    return bytes(part[2].body).decode("latin-1") if len(part) == 3 else ""


def plainly(body: memoryview, where: str) -> memoryview:
    """A compressed element in memory; `zlib.error` where its checksum, or anything else, is
    wrong."""
    unpacker = zlib.decompressobj()
    first = unpacker.decompress(body, PLENTY)
    if unpacker.eof:
        return memoryview(first)
    most = max(PLENTY, RATIO * len(body)) + 1
    whole = first + unpacker.decompress(unpacker.unconsumed_tail, most - len(first))
    must_be_believable(len(body), len(whole), where)
    if not unpacker.eof:
        raise zlib.error("the element ends too early")
    return memoryview(whole)


def read_variables(
    path: Path,
    only: frozenset[str] | None = None,
    unpack: Callable[[memoryview, str], memoryview] = plainly,
) -> Variables:
    """Every variable of a MATLAB 5 file (those of ``only``, by name or by ``struct.field``), 2-D as
    MATLAB has it. Damage raises `RecordingError`.

    Variables that are not compressed stay on disk until they are used; a compressed one carries a
    checksum, which is compared.
    """
    try:
        return _read(path, only, unpack)
    except (
        zlib.error,
        ValueError,
        IndexError,
        OverflowError,
    ) as error:  # what a damaged byte leads zlib and numpy to
        raise RecordingError(
            f"{path}: it cannot be read ({type(error).__name__}: {str(error)[:200]}). The "
            "file is damaged: save it again."
        ) from error


def _read(
    path: Path, only: frozenset[str] | None, unpack: Callable[[memoryview, str], memoryview]
) -> Variables:
    with path.open("rb") as file:
        view = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if len(view) < 128 or bytes(view[126:128]) not in (b"IM", b"MI"):
        raise RecordingError(
            f"{path}: its header is not that of a MATLAB 5 file (MATLAB 4 files are not "
            "read). Save it with -v7."
        )
    order = "<" if bytes(view[126:128]) == b"IM" else ">"
    found = Variables()
    if (len(view) - 128) % 8 and len(view) < 136:
        raise RecordingError(
            f"{path}: it ends after its header. The file is cut short: copy or save it again."
        )
    for element in elements(view[128:], order, str(path)):
        body = element.body
        if element.kind == COMPRESSED:
            inner = unpack(body, str(path))
            first = next(elements(inner, order, str(path)), None)
            if first is None or first.kind != _MATRIX:
                continue
            body = first.body
        elif element.kind != _MATRIX:
            raise RecordingError(
                f"{path}: a data element of type {element.kind} where a variable is expected. "
                "The file is damaged: save it again."
            )
        if only is None or _name_of(body, order, str(path)) in {
            name.split(".")[0].split("{")[0] for name in only
        }:
            _matrix(body, order, str(path), "", found)
    if not (found.arrays or found.sparse or found.texts or found.notes):
        raise RecordingError(
            f"{path}: it holds no variables. The file is cut short, or was saved empty."
        )
    return found
