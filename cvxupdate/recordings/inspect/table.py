"""Inspection of a table of numbers: time histories, unless its first column is a frequency axis."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.inspect.block import (
    channel_row,
    channels_line,
    rate_line,
    recordings_block,
)
from cvxupdate.recordings.inspect.channels import Column, channel_views, guessed_quantity
from cvxupdate.recordings.inspect.frf_columns import frf_columns, frf_rows
from cvxupdate.recordings.inspect.result import Inspection
from cvxupdate.recordings.read.contents import AnyArray, Contents, Progress
from cvxupdate.recordings.read.time_axis import rate_of_times, rises
from cvxupdate.recordings.types import MOTIONS

_TIMES = re.compile(
    r"(time|t|zeit|temps|tiempo|tempo|x_value|seconds?|secs?|elapsed|timestamp)"
    r"([ _]*(axis|vector|stamp|elapsed))?[ _]*[\[(]?(?P<unit>s|sec|ms|us|µs)?[\])]?",
    re.IGNORECASE,
)
_LINES = re.compile(r"(f|freq.*|fréq.*|lines?|hz)([ _]*[\[(]?hz[\])]?)?", re.IGNORECASE)
_SLOWER = {"ms": 1e3, "us": 1e6, "µs": 1e6}  # samples a second for one in the column's own unit


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
    named = count > 0 and bool(_LINES.fullmatch(names[0].strip()) or units[0] == "Hz")
    if (named and (uniform or _rises_with_gaps(data))) or (uniform and data.dtype.kind == "c"):
        return _spectra(table, progress)
    return _histories(table, progress)


def _rises_with_gaps(data: AnyArray) -> bool:
    """Whether the first column rises, were it not for damaged rows in between."""
    known = data[:, 0][np.isfinite(data[:, 0])]
    return len(known) > 2 and rises(known)


def _spectra(table: _Table, progress: Progress | None) -> Inspection:
    columns = [table.column(k, "acceleration") for k in range(1, table.data.shape[1])]
    views = channel_views(columns, float("nan"), progress)
    whole = table.data[np.all(np.isfinite(table.data), axis=1)]
    found = frf_columns(whole if len(whole) else table.data, table.names, table.units)
    coherences = {f.coherence for f in found}
    views = tuple(
        replace(v, quantity="coherence", clipped=0) if k in coherences else v
        for k, v in enumerate(views, 1)
    )
    kinds = [table.column(f.column, "acceleration").quantity for f in found]
    quantity = next((q for q in kinds if q in MOTIONS), "acceleration")
    rows = frf_rows(found, quantity)
    block = recordings_block(
        table.path,
        "frf",
        [
            f'response = "{quantity}"',
            "frequency_column = 0",
            'references = [{ node = 1, dof = "z" }]   # where it was excited',
            *rows,
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
            or _TIMES.fullmatch(table.names[k].strip())
            or (table.units[k] in ("s", "sec", "Sec", *_SLOWER) and count > 1)
        ):
            try:
                return k, rate_of_times(table.data[:, k], str(table.path)) * _unit(table, k), notes
            except RecordingError as error:
                notes.append(str(error))
    return -1, rate, notes


def _unit(table: _Table, k: int) -> float:
    """How many of the units of a column of times make a second."""
    named = _TIMES.fullmatch(table.names[k].strip())
    return _SLOWER.get(table.units[k] or ((named and named["unit"]) or ""), 1.0)


def _histories(table: _Table, progress: Progress | None) -> Inspection:
    times, rate, notes = _times(table)
    keys = [k for k in range(table.data.shape[1]) if k != times]
    views = channel_views([table.column(k) for k in keys], rate, progress)
    slower = times >= 0 and _unit(table, times) != 1.0  # a problem file has its times in seconds
    head = f"time_column = {times}" if times >= 0 and not slower else rate_line(rate)
    rows = [channel_row(k, v) for k, v in zip(keys, views, strict=True)]
    return Inspection(
        str(table.path),
        table.contents.format,
        "time",
        rate,
        len(table.data),
        views,
        (),
        (*table.contents.notes, *notes, *_of_a_model(table)),
        recordings_block(table.path, "time", [head, channels_line(views), *rows, "]"]),
    )


def _of_a_model(table: _Table) -> list[str]:
    """A table of nodes or elements is often handed over for one of recordings."""
    if table.names[0].strip().lower() != "id":
        return []
    return [
        f"{', '.join(table.names[:5])} look like a table of nodes or elements: it goes into "
        "[model], not into a recording"
    ]
