"""Universal File Format: data sets 15, 55, 58, 58b, 151 and 164.

Read here rather than by pyuff, because a laboratory's file is large, and is not always whole: a
binary body may contain the bytes of a block's end mark (so its stated length is used), an
incomplete set must be said and not padded, and functions of 500 MB stay on disk. The tests compare
with pyuff. Source: University of Cincinnati SDRL, Universal File Datasets Summary.
"""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Format, Function, Options, Shape
from cvxupdate.recordings.read.uff_fields import Units, units_of
from cvxupdate.recordings.read.uff_function import body_bytes, function_header, read_function
from cvxupdate.recordings.read.uff_shape import read_shape


@dataclass(frozen=True)
class _Block:
    """One data set: its type (``"58b"``), its header lines, and where its body begins and ends
    in the file."""

    number: int
    type: str
    lines: tuple[str, ...]
    start: int
    stop: int


def _line_end(view: mmap.mmap, at: int) -> int:
    """Offset just behind the line that starts at ``at``."""
    end = view.find(b"\n", at)
    return len(view) if end < 0 else end + 1


def _find_mark(view: mmap.mmap, at: int) -> tuple[int, int] | None:
    """The next line that holds nothing but -1: (offset of the line, offset behind it)."""
    while at < len(view):
        place = view.find(b"-1", at)
        if place < 0:
            return None
        begin = view.rfind(b"\n", max(0, place - 20), place) + 1
        begin = begin if begin > 0 else (0 if place < 20 else -1)
        end = _line_end(view, place)
        if begin >= 0 and view[begin:end].strip() == b"-1":
            return begin, end
        at = place + 2
    return None


def _mark_at(view: mmap.mmap, at: int) -> tuple[int, int] | None:
    """The end mark that stands right here, or behind one line break: (offset, offset behind it)."""
    for begin in (at, at + 1, at + 2):
        end = _line_end(view, begin) if begin < len(view) else begin
        if (
            view[at:begin].strip() == b""
            and view[begin : min(end, begin + 90)].strip() == b"-1"
            and view[begin : begin + 1] != b"\n"
        ):
            return begin, end
    return None


def _blocks(view: mmap.mmap, notes: list[str], damage: list[str]) -> Iterator[_Block]:
    """The data sets of a file in order; a binary body is stepped over by its stated length."""
    number = 0
    opening = _find_mark(view, 0)
    while opening is not None:
        begin = opening[1]
        first_end = _line_end(view, begin)
        type_line = view[begin : min(first_end, begin + 200)].decode("latin-1")
        type_ = type_line[:7].strip()
        if type_line.strip() == "-1":  # some writers repeat the opening mark
            opening = (begin, first_end)
            continue
        number += 1
        lines, at = [type_line], first_end
        if type_ == "58b":
            for _ in range(11):
                end = _line_end(view, at)
                lines.append(view[at : min(end, at + 400)].decode("latin-1").rstrip("\r\n"))
                at = end
            length = body_bytes(lines)
            closing = _mark_at(view, at + length) if length is not None else None
            # the end mark follows the body at once; if it does not, the stated length is wrong and
            # the next mark counts
            if closing is None:
                closing = _find_mark(view, at)
                notes.append(f"data set {number}: the length of its binary body is misstated")
        else:
            closing = _find_mark(view, at)
        if closing is None:
            notes.append(
                f"data set {number} ({type_ or 'no type'}) is cut off by the end of the file"
            )
            if not type_:  # of a set with a type it shows in what it holds
                damage.append(notes[-1])
            closing = (len(view), len(view))
        yield _Block(number, type_, tuple(lines), at, closing[0])
        opening = _find_mark(view, closing[1])


def _nodes(text: str, units: Units) -> dict[int, tuple[float, float, float]]:
    """Data set 15: node label, two coordinate systems, colour, x, y, z; the coordinates in
    metres."""
    nodes: dict[int, tuple[float, float, float]] = {}
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        if len(words) < 7:
            raise RecordingError(f"a node's line has {len(words)} fields, not 7")
        x, y, z = (float(word.lower().replace("d", "e")) / units.length for word in words[4:7])
        nodes[int(words[0])] = (x, y, z)
    return nodes


def read_uff(path: Path, options: Options) -> Contents:
    """The functions (58, 58b), shapes (55), nodes (15) and units (164) of a universal file.

    A set that is of another kind, or damaged, is left out and named in ``notes``; the others are
    kept; a damaged one is also in ``damage``. Binary bodies remain views of the file. Raises
    `RecordingError` when no set can be read at all.
    """
    if path.stat().st_size == 0:
        raise RecordingError(f"{path}: the file is empty.")
    with path.open("rb") as file:
        view = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    found = _Found(view, [])
    blocks = list(_blocks(view, found.notes, found.damage))
    units = found.units(blocks)
    for block in blocks:
        if block.type not in ("55", "58", "58b", "15", "151", "164"):
            found.notes.append(
                f"data set {block.number} is of type {block.type!r}, which is not a "
                "recording; it was left out"
            )
            continue
        try:
            found.read(block, units)
        except (RecordingError, ValueError, IndexError, OverflowError) as error:
            found.lost(f"data set {block.number} ({block.type}) cannot be read: {error}")
    if not found.functions and not found.shapes and not found.nodes:
        why = "; ".join(found.notes[:3])
        why = why or "it has no data set between two lines of -1"
        raise RecordingError(
            f"{path}: nothing in this universal file can be read: {why}. Export it again as UFF 58."
        )
    return Contents(
        str(path),
        "uff",
        functions=tuple(found.functions),
        shapes=tuple(found.shapes),
        nodes=found.nodes,
        notes=tuple(found.notes),
        damage=tuple(found.damage),
    )


@dataclass(frozen=True)
class _Found:
    """What was read of a mapped file so far."""

    view: mmap.mmap
    notes: list[str]
    functions: list[Function] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)

    def lost(self, what: str) -> None:
        """Note a set that was recorded and cannot be read."""
        self.notes.append(what)
        self.damage.append(what)

    def text(self, block: _Block) -> str:
        return self.view[block.start : block.stop].decode("latin-1")

    def units(self, blocks: list[_Block]) -> Units:
        """Those of the last readable data set 164, else SI."""
        units = Units()
        for block in (block for block in blocks if block.type == "164"):
            try:
                units = units_of(self.text(block))
            except (RecordingError, ValueError, IndexError) as error:
                self.lost(
                    f"data set {block.number} (164, units) cannot be read: {error}; SI units "
                    "are assumed"
                )
        return units

    def read(self, block: _Block, units: Units) -> None:
        """Add a function, a shape or nodes; raises what a damaged set leads to."""
        if block.type in ("58", "58b"):
            self.functions.append(self._function(block, units))
        elif block.type == "55":
            self.shapes.append(read_shape(self.text(block), units))
        elif block.type == "15":
            self.nodes.update(_nodes(self.text(block), units))

    def _function(self, block: _Block, units: Units) -> Function:
        lines, start = block.lines, block.start
        if block.type == "58":
            head = self.view[start : start + 4000].decode("latin-1").split("\n")[:11]
            lines = (block.lines[0], *(line.rstrip("\r") for line in head))
            for _ in range(11):
                start = _line_end(self.view, start)
        return read_function(function_header(lines), self.view, start, block.stop, units)


def _looks(head: bytes) -> bool:
    return re.match(rb"(\s*-1\s*\r?\n)+\s*\d{1,4}b?\b", head) is not None


UFF = Format(
    "uff", (".uff", ".unv", ".uf", ".bunv"), _looks, read_uff, also=("uff58",), disguised="read"
)
