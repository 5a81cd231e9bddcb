"""The data elements that a MATLAB 5 file is made of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError

KINDS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
COMPRESSED = 15

AnyArray = NDArray[Any]


@dataclass(frozen=True)
class Element:
    """A data element: its type, and its bytes."""

    kind: int
    body: memoryview


def elements(body: memoryview, order: str, where: str) -> Iterator[Element]:
    """The data elements of a buffer, one behind the other; a length that leaves the buffer
    raises."""
    at = 0
    while at + 8 <= len(body):
        first, size = np.frombuffer(body, f"{order}u4", 2, at).tolist()
        if first >> 16:  # a small element: type and length in four bytes, four bytes of data follow
            kind, size, start, step = first & 0xFFFF, first >> 16, at + 4, 8
            if size > 4:
                raise RecordingError(
                    f"{where}: a small element of {size} bytes. The file is damaged: save it again."
                )
        else:
            kind, start = first, at + 8
            step = 8 + (size if kind == COMPRESSED else 8 * math.ceil(size / 8))
        if start + size > len(body):
            raise RecordingError(
                f"{where}: an element of {size} bytes where {len(body) - start} are left. The "
                "file is cut short or damaged: copy or save it again."
            )
        yield Element(kind, body[start : start + size])
        at += step


def numbers(element: Element, order: str, where: str) -> AnyArray:
    """The numbers of an element, in the byte order of the file."""
    if element.kind not in KINDS:
        raise RecordingError(
            f"{where}: data of type {element.kind}, which is not a number. The file is "
            "damaged: save it again."
        )
    dtype = np.dtype(order + KINDS[element.kind])
    if len(element.body) % dtype.itemsize:
        raise RecordingError(
            f"{where}: {len(element.body)} bytes do not hold whole numbers. The file is "
            "damaged: save it again."
        )
    return np.frombuffer(element.body, dtype)
