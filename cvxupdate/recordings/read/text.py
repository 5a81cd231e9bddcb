"""CSV and text: any delimiter, headers, Latin-1, decimal commas, complex numbers as text, a short
last line."""

from __future__ import annotations

import codecs
import io
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options, Progress
from cvxupdate.recordings.read.disk_buffer import PIECE, DiskBuffer
from cvxupdate.recordings.read.text_layout import Layout, fields, find_layout, number, row

_SAMPLE = 400  # lines looked at for the layout
_PIECE = 65536  # rows parsed at a time
_SAID = 3  # damaged lines that are named one by one


def encoding_of(path: Path) -> str:
    """utf-8, utf-16 by its mark, else latin-1 (which reads any byte); raises `RecordingError` for a
    binary file."""
    with path.open("rb") as file:
        head = file.read(65536)
        if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return "utf-16"
        if b"\0" in head:
            raise RecordingError(
                f"{path}: it holds binary bytes, not text. If it is one of UFF, MAT, HDF5 or "
                "NPZ, set format."
            )
        decoder = codecs.getincrementaldecoder("utf-8")()
        try:
            piece = head
            while piece:
                decoder.decode(piece)
                piece = file.read(2**20)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return "latin-1"
    return "utf-8-sig"


def layout_of(path: Path, options: Options) -> Layout:
    """The layout of a text file, from its first lines."""
    encoding = options.encoding or encoding_of(path)
    try:
        with path.open(encoding=encoding) as file:
            lines = list(
                itertools.islice(
                    file, _SAMPLE + (options.skip_rows or 0) + (options.header_lines or 0)
                )
            )
    except (LookupError, UnicodeError) as error:
        raise RecordingError(
            f"{path}: it cannot be read as {encoding} ({error}). Set encoding in the "
            "[[recordings]] block."
        ) from error
    if not lines:
        raise RecordingError(f"{path}: the file is empty.")
    return find_layout(lines, encoding, options, str(path))


def _fast(lines: Sequence[str], layout: Layout) -> NDArray[Any] | None:
    """A piece parsed in one go, or None when a row is not plain."""
    if layout.marks is not None and any(
        line.count(layout.delimiter or "") != layout.marks for line in lines
    ):
        return None
    text: Sequence[str] = lines
    if layout.decimal == ",":
        text = [line.replace(",", ".") for line in lines]
    if layout.is_complex:
        text = (
            [line.replace(" ", "").replace("i", "j").replace("*", "") for line in text]
            if layout.delimiter != " "
            else text
        )
    try:
        table = np.loadtxt(
            text,
            dtype=complex if layout.is_complex else float,
            comments=None,
            delimiter=layout.delimiter,
            ndmin=2,
            usecols=None if layout.marks is None else range(layout.columns),
        )
    except (ValueError, OverflowError):
        return None
    return table if table.shape == (len(lines), layout.columns) else None


@dataclass
class _Damage:
    """What is wrong with the rows read so far: ``damage`` in the table, ``pending`` lines that are
    no rows (a sign of damage only once a row follows), and how many of those hold numbers."""

    damage: list[str] = field(default_factory=list)
    pending: list[tuple[int, str]] = field(default_factory=list)
    waiting: int = 0
    numeric: int = 0

    def wait(self, number_: int, line: str, numeric: bool) -> None:
        """A line that is no row."""
        self.waiting += 1
        self.numeric += numeric
        if len(self.pending) < _SAID:
            self.pending.append((number_, line))

    def broken(self, columns: int, after: int) -> int:
        """A row follows in line ``after``, so what waited stands within the table: how many lines
        that are."""
        count = self.waiting
        for number_, line in self.pending:
            self.damage.append(
                f"line {number_} is not a row of {columns} numbers ({line.strip()[:60]!r}), but "
                f"line {after} goes on"
            )
        if count > len(self.pending):
            self.damage.append(f"{count - len(self.pending)} more lines before it are no rows")
        self.pending, self.waiting, self.numeric = [], 0, 0
        return count


def _slow(lines: Sequence[tuple[int, str]], layout: Layout, found: _Damage) -> NDArray[Any]:
    """A piece row by row. Missing values, and whole rows that are none but stand within the table,
    become NaN, so that the rows around them keep their places."""
    table: list[list[complex | float]] = []
    kind = complex if layout.is_complex else float
    for line_number, line in lines:
        cut = fields(line, layout.delimiter)
        if (
            layout.marks is not None
            and len(cut) < layout.columns
            and line.count(layout.delimiter or "") == layout.marks
        ):
            cut += [""] * (layout.columns - len(cut))  # empty last fields
        values = [number(text, layout.decimal) for text in cut]
        if len(values) == layout.columns and all(
            v is not None and (layout.is_complex or not isinstance(v, complex)) for v in values
        ):
            table += [[kind("nan")] * layout.columns] * (
                found.broken(layout.columns, line_number) if found.waiting else 0
            )
            table.append([kind(v) for v in values])  # type: ignore[arg-type]
        else:
            found.wait(
                line_number,
                line,
                row(line, layout.delimiter, layout.decimal) is not None or _mostly(values),
            )
    return np.array(table, dtype=kind).reshape(len(table), layout.columns)


def _mostly(values: Sequence[complex | float | None]) -> bool:
    """Whether at least half of the fields of a line are numbers: a damaged row, no text."""
    good = sum(v is not None and v == v for v in values)
    return good > 0 and 2 * good >= len(values)


def text_pieces(
    path: Path, layout: Layout, found: _Damage, progress: Progress | None = None
) -> Iterator[NDArray[Any]]:
    """The rows of the table, some tens of thousands at a time, (rows, columns) real or complex;
    what is wrong with them is gathered on the way."""
    size = path.stat().st_size
    kind = complex if layout.is_complex else float
    with path.open("rb") as raw, io.TextIOWrapper(raw, encoding=layout.encoding) as file:
        numbered = (
            (place + 1, line)
            for place, line in enumerate(file)
            if place >= layout.first and line.strip()
        )
        while piece := list(itertools.islice(numbered, _PIECE)):
            table = _fast([line for _, line in piece], layout)
            if table is None:
                table = _slow(piece, layout, found)
            elif found.waiting:
                gone = found.broken(layout.columns, piece[0][0])
                table = np.concatenate([np.full((gone, layout.columns), np.nan, kind), table])
            yield table
            if progress is not None and size > PIECE and not raw.closed:
                progress(f"reading {path.name}", raw.tell(), size)


def _end(found: _Damage) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """(damage, cut): lines behind the last row. Text is a footer; one line of numbers is a row that
    was cut off, several are damage."""
    if not found.waiting:
        return tuple(found.damage), ()
    line_number, line = found.pending[0]
    if found.numeric > 1:
        what = f"line {line_number} ({line.strip()[:60]!r}) and {found.waiting - 1} more behind it"
        return (*found.damage, f"{what} are no rows of the table"), ()
    if found.numeric == 1:
        says = f"line {line_number}, the last one, is cut off ({line.strip()[:60]!r})"
        return tuple(found.damage), (says,)
    return tuple(found.damage), ()


def _gathered(pieces: Iterator[NDArray[Any]], where: str) -> NDArray[Any]:
    """All rows as one table; from some tens of megabytes on it lies on disk, so that the table is
    not held twice, nor even once."""
    held = list(itertools.islice(pieces, 1))
    if not held:
        return np.zeros((0, 1))
    total = held[0].nbytes
    for piece in pieces:
        held.append(piece)
        total += piece.nbytes
        if total > 4 * PIECE:
            break
    else:
        return held[0] if len(held) == 1 else np.concatenate(held)
    buffer = DiskBuffer(where)
    for piece in itertools.chain(held, pieces):
        buffer.add(piece)
    return np.asarray(np.frombuffer(buffer.view(), held[0].dtype).reshape(-1, held[0].shape[1]))


def _commands(path: Path, encoding: str) -> dict[str, AnyArray]:
    """Lines of ``key,value`` under section marks, as instruments write their settings: the values
    of each key in order."""
    arrays: dict[str, list[float]] = {}
    with path.open(encoding=encoding) as file:
        for line in itertools.islice(file, 100_000):
            for delimiter in ("=", "\t", ";", ","):
                cut = fields(line, delimiter)
                value = number(cut[1], ".") if len(cut) == 2 else None
                if isinstance(value, float) and value == value and cut[0].strip():
                    arrays.setdefault(cut[0].strip(), []).append(value)
                    break
    return {key: np.array(values) for key, values in arrays.items()}


def read_text(path: Path, options: Options) -> Contents:
    """The table of a text file under ``"data"``, with the names and units of its header.

    The first blank line, header blocks (``***End_of_Header***`` and any other), a comment column
    that only the header has, and a short last line are dealt with; a line in the middle that is not
    a row of numbers becomes a row of NaN and is said in ``damage``.
    """
    try:
        layout = layout_of(path, options)
    except RecordingError:
        arrays = _commands(path, options.encoding or encoding_of(path))
        if sum(values.size for values in arrays.values()) < 6:
            raise
        return Contents(str(path), "settings", arrays, notes=("a list of settings, not a table",))
    found = _Damage()
    data = _gathered(text_pieces(path, layout, found, options.progress), str(path))
    if len(data) < 2:
        raise RecordingError(
            f"{path}: its table has fewer than two rows. Check header_lines and the file."
        )
    damage, cut = _end(found)
    behind = [f"line {n} and what follows is no part of the table" for n, _ in found.pending[:1]]
    return Contents(
        str(path),
        "text",
        {"data": data},
        layout.names,
        layout.units,
        notes=(*layout.notes, *damage, *(cut or (() if found.numeric else behind))),
        damage=damage,
        cut=cut,
    )


TEXT = Format(
    "text",
    (".csv", ".txt", ".dat", ".asc", ".tsv", ".lvm", ".prn", ""),
    lambda head: True,
    read_text,
    also=("csv", "txt"),
    anything=True,
)
