"""What a text file's lines are: delimiter, decimal mark, where the table starts, names and units of
its columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Options
from cvxupdate.recordings.units import is_unit

_DELIMITERS = ("\t", ";", ",", "|", None)  # None: any white space
_MISSING = frozenset(
    {"", "nan", "n/a", "#n/a", "na", "null", "none", "--", "-nan", "1.#qnan", "-1.#ind"}
)
_COMPLEX = re.compile(
    r"\(?\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[-+]\s*[\d.]+(?:[eE][-+]?\d+)?\s*[ij*]+\s*\)?$|[-+]?[\d.]+(?:[eE][-+]?\d+)?[ij]$"
)
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]]+)[\])]$")


_BROKEN = 3  # damaged lines in a row that do not end a table


@dataclass(frozen=True)
class Layout:
    """How the table of a text file is written.

    ``first`` is the number of lines before its first row; ``marks`` how many delimiters a row holds
    (None for white space).
    """

    encoding: str
    delimiter: str | None
    decimal: str
    first: int
    columns: int
    marks: int | None
    is_complex: bool
    names: tuple[str, ...]
    units: tuple[str, ...]
    notes: tuple[str, ...] = ()


def number(text: str, decimal: str) -> complex | float | None:
    """A field as a number; NaN for what stands for a missing value, None when it is neither."""
    plain = text.strip().strip('"').strip("'").strip()
    if plain.lower() in _MISSING:
        return float("nan")
    if decimal == ",":
        if "." in plain or plain.count(",") > 2:
            return None
        plain = plain.replace(",", ".")
    if "_" in plain:
        return None
    try:
        return float(plain)
    except ValueError:
        pass
    if _COMPLEX.match(plain):
        try:
            return complex(plain.replace(" ", "").replace("i", "j").replace("*", ""))
        except ValueError:
            return None
    try:  # FORTRAN's double precision exponent
        return (
            float(plain.replace("D", "e").replace("d", "e"))
            if re.fullmatch(r"[-+.\d]+[dD][-+]?\d+", plain)
            else None
        )
    except ValueError:
        return None


def fields(line: str, delimiter: str | None) -> list[str]:
    """The fields of a line; empty ones at the end, which a trailing delimiter leaves, are
    dropped."""
    cut = line.strip("\r\n").split(delimiter)
    while cut and not cut[-1].strip():
        cut.pop()
    return cut


def row(line: str, delimiter: str | None, decimal: str) -> list[complex | float] | None:
    """A line as numbers, or None when it is not a row of numbers (a row has at least one that is
    not missing)."""
    numbers = []
    for field in fields(line, delimiter):
        value = number(field, decimal)
        if value is None:
            return None
        numbers.append(value)
    return numbers if any(value == value for value in numbers) else None


def _stretches(
    lines: Sequence[str], first: int, delimiter: str | None, decimal: str
) -> list[tuple[int, int, int]]:
    """(first line, rows, columns) of every run of rows with the same number of columns; blank lines
    do not end a run."""
    runs: list[tuple[int, int, int]] = []
    for place in range(first, len(lines)):
        if not lines[place].strip():
            continue
        numbers = row(lines[place], delimiter, decimal)
        if numbers is None:
            runs.append((place, 0, 0))
        elif runs and runs[-1][2] == len(numbers):
            runs[-1] = (runs[-1][0], runs[-1][1] + 1, runs[-1][2])
        else:
            runs.append((place, 1, len(numbers)))
    return [run for run in runs if run[1] > 0]


def _top(
    lines: Sequence[str], first: int, skip: int, columns: int, delimiter: str | None, decimal: str
) -> int:
    """The first row of the table whose longest run begins at ``first``: a damaged row ends a run,
    not the table. At most `_BROKEN` lines that are mostly numbers may stand between two runs, and a
    first column that rises must go on rising, else it is another table."""
    above, gap = first, 0
    axis = _axis(lines[first:], columns, delimiter, decimal)
    for k in range(first - 1, skip - 1, -1):
        if not lines[k].strip():
            continue
        values = [number(text, decimal) for text in fields(lines[k], delimiter)]
        good = [v for v in values if v is not None and v == v]
        if len(good) == len(values) == columns:
            here = good[0].real
            if len(axis) == 3 and not here < axis[0] < here + 4.0 * (gap + 1) * (axis[2] - axis[0]):
                break
            above, gap = k, 0
            axis = [here, *axis[:2]] if len(axis) == 3 else axis
        elif gap < _BROKEN and 2 * len(good) >= columns:
            gap += 1
        else:
            break
    return above


def _axis(lines: Sequence[str], columns: int, delimiter: str | None, decimal: str) -> list[float]:
    """The first three entries of the first column where they rise, else nothing."""
    rows = [row(line, delimiter, decimal) for line in lines[:3]]
    start = [numbers[0].real for numbers in rows if numbers and len(numbers) == columns]
    rising = len(start) == 3 and start[0] < start[1] < start[2]
    return start if rising and columns > 1 else []


def _header(
    lines: Sequence[str], delimiter: str | None, columns: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the columns, from the lines above the table; empty where there are
    none."""
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    for line in reversed(lines):
        cut = [field.strip().strip('"').strip("'").strip() for field in fields(line, delimiter)]
        if not cut:
            continue
        if (
            cut[0] == "Y_Unit_Label" and len(cut) >= columns - 1
        ):  # LabVIEW: the abscissa has no unit label
            units = units or ("", *cut[1:columns])
        if (
            len(cut) < columns
            or len(cut) > columns + 2
            or (names and len(set(names)) == len(names))
        ):
            continue
        if all(field.startswith(("[", "(")) for field in cut) or (
            all(is_unit(field) for field in cut) and not units
        ):
            units = tuple(field.strip("[]() ") for field in cut[:columns])
        else:
            names = tuple(cut[:columns])
    if names and not units:
        split = [_BRACKETED.match(name) for name in names]
        if any(m is not None and is_unit(m["unit"]) for m in split):
            units = tuple(
                m["unit"].strip() if m is not None and is_unit(m["unit"]) else "" for m in split
            )
            names = tuple(
                m["name"].strip() if m is not None and is_unit(m["unit"]) else name
                for m, name in zip(split, names, strict=True)
            )
    return names, units


def find_layout(lines: Sequence[str], encoding: str, options: Options, where: str) -> Layout:
    """The layout of a text file from its first lines: the longest run of rows of numbers is the
    table.

    Of several ways to cut the lines the one with the longest run counts, then the one with more
    columns. Raises `RecordingError` when no run of two rows is found.
    """
    skip = (options.skip_rows or 0) + (options.header_lines or 0)
    best: tuple[tuple[int, int], str | None, str, int, int] | None = None
    for delimiter in (options.delimiter,) if options.delimiter else _DELIMITERS:
        for decimal in (options.decimal,) if options.decimal else (".", ","):
            if decimal == "," and (
                delimiter == "," or not any("," in line for line in lines[skip:])
            ):
                continue
            runs = _stretches(lines, skip, delimiter, decimal)
            if not runs:
                continue
            place, rows, columns = max(runs, key=lambda run: (run[1], run[2]))
            if best is None or (rows, columns) > best[0]:
                best = ((rows, columns), delimiter, decimal, place, columns)
    if best is None or best[0][0] < 2:
        raise RecordingError(
            f"{where}: no table of numbers was found in its first "
            f"{f'{len(lines)} lines' if len(lines) > 1 else 'line'}. Say "
            "delimiter, decimal and header_lines in the [[recordings]] block, or check the "
            "file."
        )
    (_, columns), delimiter, decimal, first, _ = best
    first = _top(lines, first, skip, columns, delimiter, decimal)
    if options.header_lines is not None:
        first = skip
        while first < len(lines) and not lines[first].strip():
            first += 1
    notes = tuple(
        f"lines {place + 1} to {place + rows} hold another table ({rows} rows of {count}); it "
        "was left out"
        for place, rows, count in _stretches(lines[:first], skip, delimiter, decimal)
        if rows >= 3 and count > 1
    )
    sample = [row(line, delimiter, decimal) for line in lines[first : first + 50] if line.strip()]
    is_complex = any(
        isinstance(value, complex) for numbers in sample if numbers for value in numbers
    )
    names, units = _header(lines[options.skip_rows or 0 : first], delimiter, columns)
    marks = None if delimiter is None else lines[first].strip("\r\n").count(delimiter)
    return Layout(
        encoding, delimiter, decimal, first, columns, marks, is_complex, names, units, notes
    )
