"""Universal data sets 58 and 58b: functions at a DOF."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Function, Point
from cvxupdate.recordings.read.disk_buffer import PIECE
from cvxupdate.recordings.read.uff_fields import QUANTITY, Units, direction, fields, integer, real
from cvxupdate.recordings.units import is_unit, parse_unit

_NUMBER = re.compile(
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?|[-+]?(?:nan|inf)\w*", re.IGNORECASE
)


@dataclass(frozen=True)
class Header:
    """Records 1 to 11, and what the first line says of a binary body (``order`` "<" or ">", None
    for text)."""

    order: str | None
    title: str
    kind: int
    response: Point
    reference: Point
    double: bool
    complex: bool
    points: int
    even: bool
    start: float
    step: float
    quantity: str
    per: str
    unit: str
    per_unit: str


def body_bytes(lines: Sequence[str]) -> int | None:
    """The length of a binary body: what the number of points needs, else what the first line
    states, None if unreadable."""
    try:
        stated = integer(lines[0][31:43].strip(), "the number of bytes")
        header = function_header(lines)
    except RecordingError:
        return None
    return stated if stated in _lengths(header) else max(_lengths(header))


def _lengths(header: Header) -> tuple[int, ...]:
    """The possible lengths of a binary body; an uneven double abscissa is single by the standard,
    double as pyuff writes it."""
    size = 8 if header.double else 4
    ordinate = header.points * size * (2 if header.complex else 1)
    if header.even:
        return (ordinate,)
    return tuple(dict.fromkeys((ordinate + header.points * size, ordinate + header.points * 4)))


def function_header(lines: Sequence[str]) -> Header:
    """The header from its twelve lines (the type's line first); raises `RecordingError` with the
    field that is wrong."""
    if len(lines) < 12:
        raise RecordingError("the header is cut short")
    order: str | None = None
    if lines[0][6:7].lower() == "b":
        order = "<" if integer(lines[0][7:13].strip(), "the byte order") == 1 else ">"
        if integer(lines[0][13:19].strip(), "the floating-point format") not in (0, 2):
            raise RecordingError("its numbers are not IEEE 754 (VAX and IBM formats are not read)")
    six = fields(lines[6], (5, 10, 5, 10, 11, 10, 4, 11, 10, 4))
    seven = fields(lines[7], (10, 10, 10, 13, 13, 13))
    kind = integer(six[0], "the function type")
    data_type = integer(seven[0], "the ordinate data type")
    points = integer(seven[1], "the number of points")
    if data_type not in (2, 4, 5, 6) or points < 0:
        raise RecordingError(f"ordinate data type {data_type} with {points} points is not read")
    even = integer(seven[2], "the abscissa spacing") == 1
    axes = [fields(lines[i], (10, 5, 5, 5, 21, 21)) for i in (9, 10)]
    ends = []
    for node, code in ((six[5], six[6]), (six[8], six[9])):
        dof, sign = direction(integer(code or "0", "a direction"))
        ends.append(Point(integer(node or "0", "a node"), dof, sign))
    return Header(
        order,
        lines[1].strip(),
        kind,
        ends[0],
        ends[1],
        data_type in (4, 6),
        data_type in (5, 6),
        points,
        even,
        real(seven[3], "the abscissa's minimum") if even else 0.0,
        real(seven[4], "the abscissa's step") if even else 0.0,
        QUANTITY.get(integer(axes[0][0] or "0", "the data type of the ordinate"), "unknown"),
        QUANTITY.get(integer(axes[1][0] or "0", "the data type of the denominator"), ""),
        axes[0][5],
        axes[1][5],
    )


def _binary(
    header: Header, view: mmap.mmap, start: int, stop: int
) -> tuple[NDArray[Any] | None, NDArray[Any]]:
    # a line break may stand between the body and the end mark; more than that, and the number of
    # points is not the file's
    fits = [n for n in _lengths(header) if n <= stop - start <= n + 4]
    if not fits:
        raise RecordingError(
            f"it has {stop - start} bytes where {header.points} points need {max(_lengths(header))}"
        )
    size = (8 if header.double else 4) * (2 if header.complex else 1)
    kind = f"{header.order}{'c' if header.complex else 'f'}{size}"
    if header.even:
        return None, np.frombuffer(view, kind, header.points, start)
    wide = header.double and max(fits) == max(_lengths(header))
    pair = np.frombuffer(
        view,
        np.dtype([("x", f"{header.order}f{8 if wide else 4}"), ("y", kind)]),
        header.points,
        start,
    )
    return np.asarray(pair["x"], dtype=float), np.asarray(pair["y"])


def _text(
    header: Header, view: mmap.mmap, start: int, stop: int
) -> tuple[NDArray[Any] | None, NDArray[Any]]:
    per = (2 if header.complex else 1) + (0 if header.even else 1)
    pieces = [_numbers(view[at:end]) for at, end in _cuts(view, start, stop)]
    numbers = np.concatenate([*pieces, np.zeros(0)])
    if numbers.size != per * header.points:
        raise RecordingError(
            f"it has {numbers.size} numbers where {header.points} points need {per * header.points}"
        )
    table = numbers.reshape(header.points, per)
    x = None if header.even else table[:, 0].copy()
    y = table[:, -2] + 1j * table[:, -1] if header.complex else table[:, -1].copy()
    return x, y


def _cuts(view: mmap.mmap, start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Runs of whole lines of some megabytes: words of text take ten times the memory of their
    numbers."""
    while start < stop:
        end = stop if stop - start <= PIECE // 4 else view.find(b"\n", start + PIECE // 4, stop) + 1
        end = end if end > start else stop
        yield start, end
        start = end


def _numbers(body: bytes) -> NDArray[np.float64]:
    """Fixed-width fields may touch (a minus sign fills the gap): then they are cut before a sign
    that is not an exponent's."""
    body = body.replace(b"D", b"e")
    try:
        return np.array(body.split(), dtype=float)
    except ValueError:
        return np.array([float(word) for word in _NUMBER.findall(body)], dtype=float)


def _scale(header: Header, units: Units) -> tuple[float, str]:
    """Factor to SI: the axis labels where they name units, else the file's data set 164."""
    factor, names = 1.0, []
    labels = (
        (header.quantity, header.unit, header.response.dof, 1),
        (header.per, header.per_unit, header.reference.dof, -1),
    )
    for quantity, unit, dof, power in labels:
        if not quantity or header.kind == 6:
            continue
        if is_unit(unit):
            factor *= parse_unit(unit).factor ** power
            names.append(unit)
        else:
            factor *= units.scale(quantity, dof.startswith("r")) ** power
    return factor, "/".join(names)


def read_function(header: Header, view: mmap.mmap, start: int, stop: int, units: Units) -> Function:
    """One function; a body that does not hold the stated number of points raises `RecordingError`,
    nothing is padded."""
    if header.even and not header.step > 0.0 and header.points > 1:
        raise RecordingError(f"the step of its abscissa is {header.step}")
    x, y = (_text if header.order is None else _binary)(header, view, start, stop)
    if x is not None and (not np.all(np.isfinite(x)) or np.any(np.diff(x) <= 0.0)):
        raise RecordingError("its abscissa does not increase")
    factor, unit = _scale(header, units)
    return Function(
        header.kind,
        header.response,
        header.reference,
        header.start,
        header.step,
        x,
        y,
        header.quantity,
        header.per,
        unit,
        factor,
        header.title,
    )
