"""Harwell–Boeing, as Ansys's HBMAT writes it: assembled matrices, real, symmetric or not.

Source: I. S. Duff, R. G. Grimes and J. G. Lewis, Users' guide for the Harwell–Boeing sparse matrix
collection (1992). Ansys writes job.mapping beside it: equation, node, direction.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.found import Found, Label, mirrored

DIRECTIONS = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
_FORMAT = re.compile(r"(\d*)\s*([IEFDG])\s*(\d+)", re.IGNORECASE)
_MAPPED = re.compile(r"\s*(\d+)\s+(\d+)\s+(U[XYZ]|ROT[XYZ])\b", re.IGNORECASE)
NAME = "matrix"


def read_harwell_boeing(path: Path) -> Found:
    """The one matrix of the file, with the labels of a .mapping beside it.

    Raises
    ------
    ModelError
        For another type of matrix, or a file that is cut short.
    """
    lines = path.read_text(encoding="latin-1").splitlines()
    if len(lines) < 5:
        raise ModelError(f"{path}: is too short for a Harwell–Boeing file.")
    kind = lines[2][:3].upper()
    if len(kind) < 3 or kind[0] not in "RP" or kind[1] not in "SU" or kind[2] != "A":
        raise ModelError(
            f"{path}: is a Harwell–Boeing matrix of type {kind!r}; RSA, RUA (real, assembled) and "
            "patterns are read. Export it so."
        )
    counts = [int(n) for n in lines[1].split()]
    rows, columns, entries = (int(n) for n in lines[2][3:].split()[:3])
    formats = [lines[3][:16], lines[3][16:32], lines[3][32:52]]
    begin = 5 if len(counts) > 4 and counts[4] > 0 else 4
    body = iter(lines[begin:])
    whole: Callable[[str], Any] = int
    pointers = _numbers(path, body, formats[0], columns + 1, whole).astype(np.int64) - 1
    index = _numbers(path, body, formats[1], entries, whole).astype(np.int64) - 1
    values = (
        np.ones(entries)
        if kind[0] == "P"
        else _numbers(path, body, formats[2], entries, lambda t: float(t.upper().replace("D", "E")))
    )
    if pointers[0] != 0 or pointers[-1] != entries or np.any(np.diff(pointers) < 0):
        raise ModelError(f"{path}: its column pointers do not fit its {entries} entries.")
    if rows != columns or index.min(initial=0) < 0 or index.max(initial=0) >= rows:
        raise ModelError(f"{path}: is {rows} x {columns} with entries outside, not square.")
    A = sp.csc_array((values, index, pointers), shape=(rows, columns))
    if kind[1] == "S":
        t = A.tocoo()
        A = mirrored(t.row.astype(np.int64), t.col.astype(np.int64), t.data, rows)
    labels = _labels(path.with_suffix(".mapping"), rows)
    return Found({NAME: sp.csr_array(A)}, {} if labels is None else {NAME: labels})


def _numbers(
    path: Path, lines: Iterator[str], fmt: str, count: int, read: Callable[[str], Any]
) -> NDArray[Any]:
    """``count`` numbers of fixed width."""
    found = _FORMAT.search(fmt.upper().partition("P")[2] or fmt)
    if found is None:
        raise ModelError(f"{path}: the format {fmt.strip()!r} is not understood.")
    each, width = int(found[1] or 1), int(found[3])
    out: list[Any] = []
    while len(out) < count:
        line = next(lines, "").rstrip()
        expected = min(each, count - len(out))
        cells = line.split()
        if len(cells) != expected:  # numbers that touch one another
            cells = [line[k : k + width].strip() for k in range(0, len(line), width)]
        if len(cells) != expected:
            raise ModelError(
                f"{path}: is cut short or damaged: {count} numbers are announced, {len(out)} are "
                "there. Export it again."
            )
        out += [read(cell) for cell in cells]
    return np.array(out)


def _labels(path: Path, size: int) -> tuple[Label, ...] | None:
    """Node and direction of every equation; None where there is no mapping."""
    if not path.is_file():
        return None
    found = [_MAPPED.match(line) for line in path.read_text(encoding="latin-1").splitlines()]
    rows = {int(m[1]): (int(m[2]), DIRECTIONS[m[3].upper()]) for m in found if m is not None}
    if sorted(rows) != list(range(1, size + 1)):
        raise ModelError(
            f"{path}: maps {len(rows)} equations of a matrix with {size} rows. Export both again."
        )
    return tuple(rows[k] for k in range(1, size + 1))
