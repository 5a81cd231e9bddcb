"""From a file's contents to a time history."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Progress
from cvxupdate.recordings.read.time_axis import BLOCK, rate_of_times, sampling_rate
from cvxupdate.recordings.read.time_functions import blocks_of_functions
from cvxupdate.recordings.read.time_pieces import TimeBlocks, pieces_of
from cvxupdate.recordings.read.wanted import (
    Names,
    Wanted,
    channel_of,
    real_values,
    table_of,
    values_of,
)
from cvxupdate.recordings.types import Origin, Real, TimeHistory


def time_blocks(
    contents: Contents,
    wanted: Sequence[Wanted],
    origin: Origin,
    *,
    rate: float | None = None,
    time_column: int | str | None = None,
    names: Names | None = None,
    start: int = 0,
    stop: int | None = None,
) -> TimeBlocks:
    """The declared channels of a file as blocks in SI; arrays that lie on disk stay there.

    ``rate`` in Hz, or ``time_column``, or what the file states (they must agree within 0.2 %).
    ``start`` and ``stop`` cut samples as a slice does. Raises `RecordingError` naming the file and
    the channel.
    """
    names = names or Names()
    if contents.functions:
        blocks = blocks_of_functions(contents, wanted, origin, rate)
    else:
        blocks = _blocks_of_columns(contents, wanted, origin, rate, time_column, names)
    return blocks if start == 0 and stop is None else _cut(blocks, start, stop, contents.file)


def _blocks_of_columns(
    contents: Contents,
    wanted: Sequence[Wanted],
    origin: Origin,
    rate: float | None,
    time_column: int | str | None,
    names: Names,
) -> TimeBlocks:
    where = contents.file
    if not wanted:
        table = table_of(contents, names)
        count = f" It has {table.shape[1]} columns." if table is not None else ""
        raise RecordingError(
            f"{where}: its channels are not declared.{count} Give channels; `cvxupdate "
            "inspect` prints a block."
        )
    columns = [values_of(contents, names, want.column, want.index, want.label) for want in wanted]
    channels = tuple(channel_of(contents, want) for want in wanted)
    lengths = {column.shape[0] for column in columns}
    if len(lengths) != 1 or min(lengths) < 2:
        raise RecordingError(
            f"{where}: its channels have {sorted(lengths)} samples; they must have one "
            "length of at least 2."
        )
    for want, column in zip(wanted, columns, strict=True):
        if column.dtype.kind not in "biuf":
            real_values(column, f"{where}: {want.label}")
    return TimeBlocks(
        origin,
        sampling_rate(rate, _stated_rate(contents, time_column, names), where),
        channels,
        columns[0].shape[0],
        pieces_of(columns, channels),
    )


def _stated_rate(contents: Contents, time_column: int | str | None, names: Names) -> float | None:
    """The sampling rate that the file itself holds: its times, a named number, or its header."""
    where = contents.file
    if time_column is not None:
        column = values_of(contents, names, time_column)
        if column.dtype.kind not in "iuf":
            column = real_values(column, f"{where}: time_column")
        return rate_of_times(column, where)
    if "rate" not in names.given:
        return contents.rate
    value = contents.arrays.get(names["rate"])
    if value is None or value.size != 1:
        raise RecordingError(
            f"{where}: {names['rate']!r} is not a single number that could be the rate."
        )
    return float(np.real(value.ravel()[0]))


def _cut(blocks: TimeBlocks, start: int, stop: int | None, where: str) -> TimeBlocks:
    """Samples ``start`` to ``stop``, as a slice takes them."""
    first, last, _ = slice(start, stop).indices(blocks.samples)
    if last - first < 2:
        raise RecordingError(
            f"{where}: samples {start} to {stop} leave fewer than 2 of {blocks.samples}."
        )

    def cut(size: int) -> Iterator[Real]:
        at = 0
        for piece in blocks.pieces(size):
            inside = piece[max(first - at, 0) : max(last - at, 0)]
            at += len(piece)
            if len(inside):
                yield inside

    return TimeBlocks(blocks.origin, blocks.rate, blocks.channels, last - first, cut)


def gather(blocks: TimeBlocks, progress: Progress | None = None) -> TimeHistory:
    """All blocks as one `TimeHistory`, (samples, channels), filled piece by piece so that nothing
    is held twice."""
    data = np.empty((blocks.samples, len(blocks.channels)))
    at = 0
    for piece in blocks.pieces(2**16):
        data[at : at + len(piece)] = piece
        at += len(piece)
        if progress is not None and at % BLOCK < len(piece) and blocks.samples > BLOCK:
            progress(f"reading {blocks.origin.name}", at, blocks.samples)
    return TimeHistory(blocks.origin, blocks.rate, blocks.channels, data)
