"""What is in a file, before anyone has declared anything: for `cvxupdate inspect FILE`."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from cvxupdate.recordings.inspect.block import (
    channel_row,
    channels_line,
    rate_line,
    recordings_block,
)
from cvxupdate.recordings.inspect.channels import Column, channel_views, guessed_quantity
from cvxupdate.recordings.inspect.frf_arrays import frf_names, inspect_arrays
from cvxupdate.recordings.inspect.functions import inspect_functions
from cvxupdate.recordings.inspect.mode_table import mode_table_of
from cvxupdate.recordings.inspect.result import ChannelView, Inspection
from cvxupdate.recordings.inspect.table import inspect_table
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import AnyArray, Contents, Options, Progress

__all__ = ["ChannelView", "Inspection", "inspect_file"]


def inspect_file(
    path: Path | str,
    options: Options | None = None,
    format: str | None = None,
    progress: Progress | None = None,
) -> Inspection:
    """What a file holds, and a [[recordings]] block for it. Raises `RecordingError` when it cannot
    be read at all.

    Quantities are guessed from names and units, places only where the file states them: the block
    is a start, not an answer. Long time histories are read in blocks; ``progress`` is called after
    each.
    """
    path = Path(path)
    if os.path.isfile(path) and (modes := mode_table_of(path)) is not None:
        return modes
    contents = read_file(path, replace(options or Options(), progress=progress), format)
    if contents.functions or contents.shapes:
        return inspect_functions(path, contents, progress)
    names = frf_names(contents)
    if names is not None:
        return inspect_arrays(path, contents, names, progress)
    data = _table_of(contents)
    if data is not None and data.shape[0] > 1:
        return inspect_table(path, contents, data, progress)
    return _vectors(path, contents, progress)


def _table_of(contents: Contents) -> AnyArray | None:
    data = contents.arrays.get("data")
    return data if data is not None and data.ndim == 2 and data.dtype.kind in "biufc" else None


def _vectors(path: Path, contents: Contents, progress: Progress | None) -> Inspection:
    """The longest vectors of a container as channels, else a list of its arrays."""
    rate = contents.rate if contents.rate is not None else float("nan")
    vectors = {
        name: np.squeeze(a)
        for name, a in contents.arrays.items()
        if a.dtype.kind in "biuf" and np.squeeze(a).ndim == 1 and a.size >= 64
    }
    length = max((len(v) for v in vectors.values()), default=0)
    columns = [
        Column(name, "", guessed_quantity(name, ""), v)
        for name, v in vectors.items()
        if len(v) == length
    ]
    views = channel_views(columns, rate, progress)
    if not views:
        arrays = tuple(
            f"{name}: {' x '.join(map(str, a.shape)) or 'one number'}, {a.dtype}"
            for name, a in contents.arrays.items()
        )
        notes = (*contents.notes, *arrays, *_of_a_model(contents))
        return Inspection(str(path), contents.format, "arrays", rate, 0, (), (), notes, "")
    rows = [channel_row(view.name, view) for view in views]
    return Inspection(
        str(path),
        contents.format,
        "time",
        rate,
        length,
        views,
        (),
        contents.notes,
        recordings_block(path, "time", [rate_line(rate), channels_line(views), *rows, "]"]),
    )


def _of_a_model(contents: Contents) -> tuple[str, ...]:
    """A line where arrays by their names and shapes are stiffness and mass, not a recording."""
    square = [
        name
        for name, a in contents.arrays.items()
        if name[:1] in "KM" and a.ndim == 2 and a.shape[0] == a.shape[1] > 1
    ]
    if not {"K", "M"} <= {name[:1] for name in square}:
        return ()
    return (
        f"{', '.join(square)} look like matrices of a model: they go into an element of type "
        '"matrix", not into a recording',
    )
