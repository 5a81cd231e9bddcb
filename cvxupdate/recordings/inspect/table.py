"""Inspection of a table of numbers: time histories, unless its first column is a frequency axis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.inspect.block import channel_row, rate_line, recordings_block
from cvxupdate.recordings.inspect.channels import Column, channel_views, guessed_quantity
from cvxupdate.recordings.inspect.result import Inspection
from cvxupdate.recordings.read.contents import AnyArray, Contents, Progress
from cvxupdate.recordings.read.time_axis import rate_of_times, rises

_TIMES = ("time", "t", "x_value", "sec", "seconds", "time [s]", "t [s]")


@dataclass(frozen=True)
class _Table:
    """Columns with their names and units; ``uniform`` where the first column increases throughout,
    as times and frequencies do."""

    path: Path
    contents: Contents
    data: AnyArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    uniform: bool

    def column(self, k: int, kind: str = "") -> Column:
        name, unit = self.names[k], self.units[k]
        return Column(name, unit, guessed_quantity(name, unit, kind), self.data[:, k])


def inspect_table(
    path: Path, contents: Contents, data: AnyArray, progress: Progress | None
) -> Inspection:
    """A table (rows, columns): FRFs where its first column is a frequency axis, else histories."""
    if contents.format != "text" and data.shape[1] > 16 * data.shape[0]:
        data = data.T
    count = data.shape[1]
    names = contents.columns or tuple(f"column {k}" for k in range(count))
    units = contents.units or ("",) * count
    uniform = count > 0 and len(data) > 2 and rises(data[:, 0])
    table = _Table(path, contents, data, names, units, uniform)
    if uniform and (
        names[0].lower().startswith("freq") or units[0] == "Hz" or data.dtype.kind == "c"
    ):
        return _spectra(table, progress)
    return _histories(table, progress)


def _spectra(table: _Table, progress: Progress | None) -> Inspection:
    count, is_complex = table.data.shape[1], table.data.dtype.kind == "c"
    columns = [table.column(k, "acceleration") for k in range(1, count)]
    views = channel_views(columns, float("nan"), progress)
    decibel = "db" in f"{table.units[1:2]} {table.names[1:2]}".lower()
    form = (
        ""
        if is_complex or count < 3
        else f', form = "{"db" if decibel else "magnitude"}-phase", pair = 2'
    )
    rows = [
        f'  {{ column = {k}, quantity = "acceleration", node = 1, dof = "z"{form} }},'
        for k in range(1, count if is_complex else 2)
    ]
    block = recordings_block(
        table.path,
        "frf",
        [
            'response = "acceleration"',
            "frequency_column = 0",
            'references = [{ node = 1, dof = "z" }]',
            "channels = [",
            *rows,
            "]",
        ],
    )
    return Inspection(
        str(table.path),
        table.contents.format,
        "frf",
        float("nan"),
        len(table.data),
        views,
        (),
        table.contents.notes,
        block,
    )


def _times(table: _Table) -> tuple[int, float, list[str]]:
    """The column of times (-1: none), the sampling rate in Hz (NaN unknown), and what failed."""
    stated = table.contents.rate
    rate = stated if stated is not None else float("nan")
    count = table.data.shape[1]
    notes: list[str] = []
    for k in range(count):
        if (
            (table.uniform and k == 0)
            or table.names[k].lower().strip() in _TIMES
            or (table.units[k] in ("s", "sec", "Sec") and count > 1)
        ):
            try:
                return k, rate_of_times(table.data[:, k], str(table.path)), notes
            except RecordingError as error:
                notes.append(str(error))
    return -1, rate, notes


def _histories(table: _Table, progress: Progress | None) -> Inspection:
    times, rate, notes = _times(table)
    keys = [k for k in range(table.data.shape[1]) if k != times]
    views = channel_views([table.column(k) for k in keys], rate, progress)
    head = f"time_column = {times}" if times >= 0 else rate_line(rate)
    rows = [channel_row(k, v) for k, v in zip(keys, views, strict=True)]
    return Inspection(
        str(table.path),
        table.contents.format,
        "time",
        rate,
        len(table.data),
        views,
        (),
        (*table.contents.notes, *notes),
        recordings_block(table.path, "time", [head, "channels = [", *rows, "]"]),
    )
