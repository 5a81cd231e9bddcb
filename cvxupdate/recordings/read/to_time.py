"""From a file's contents to a time history."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Function, Told
from cvxupdate.recordings.read.disk import release
from cvxupdate.recordings.read.wanted import (
    Names,
    Wanted,
    channel_of,
    real_values,
    table_of,
    values_of,
)
from cvxupdate.recordings.types import Channel, Origin, Real, TimeHistory

_BLOCK = 2**20  # samples looked at together


@dataclass(frozen=True)
class TimeBlocks:
    """A time history that stays on disk: ``pieces(n)`` yields (≤ n, channels) in SI, in order, each
    sample once."""

    origin: Origin
    rate: float
    channels: tuple[Channel, ...]
    samples: int
    pieces: Callable[[int], Iterator[Real]]


def _pieces(column: AnyArray) -> Callable[[], Iterator[tuple[int, Real]]]:
    """A column as (place, numbers) of some megabytes, as often as it is asked for: it may lie on
    disk."""

    def pieces() -> Iterator[tuple[int, Real]]:
        for at in range(0, column.size, _BLOCK):
            yield at, np.asarray(np.real(column[at : at + _BLOCK]), dtype=float)
            release(column)

    return pieces


def rises(column: AnyArray) -> bool:
    """Whether every number is finite and larger than the one before, as times and frequencies
    are."""
    before = -np.inf
    for _, piece in _pieces(column)():
        if not (np.all(np.isfinite(piece)) and piece[0] > before and np.all(np.diff(piece) > 0.0)):
            return False
        before = float(piece[-1])
    return True


def rate_of_times(times: AnyArray, where: str) -> float:
    """Sampling rate from a column of times, (n - 1) / (last - first): printed times are rounded,
    their span hardly.

    Raises `RecordingError` when a time is off its even place by more than a quarter of a step: the
    record has a gap, or was not sampled evenly.
    """
    pieces = _pieces(times)
    if times.size < 2 or not all(np.all(np.isfinite(piece)) for _, piece in pieces()):
        raise RecordingError(
            f"{where}: the column of times has missing values. Give rate in the "
            "[[recordings]] block."
        )
    first, last = float(np.real(times[0])), float(np.real(times[-1]))
    step = (last - first) / (times.size - 1)
    if not step > 0.0:
        raise RecordingError(
            f"{where}: the times do not increase. Give the right time_column, or rate."
        )
    for at, piece in pieces():
        off = np.abs(piece - (first + step * np.arange(at, at + piece.size)))
        if off.max() > 0.25 * step:
            worst = int(np.argmax(off))
            raise RecordingError(
                f"{where}: the samples are not evenly spaced: sample {at + worst} is "
                f"{off[worst]:.3g} s off its place, with a step of {step:.3g} s. Resample it, "
                "or give rate if the times are wrong."
            )
    return float(1.0 / step)


def _rate(given: float | None, stated: float | None, where: str) -> float:
    if given is None and stated is None:
        raise RecordingError(
            f"{where}: the file does not say its sampling rate. Give rate (Hz) or time_column."
        )
    if given is not None and stated is not None and abs(given - stated) > 2e-3 * stated:
        raise RecordingError(
            f"{where}: the problem file says rate = {given:g} Hz, but the file itself says "
            f"{stated:g} Hz. Correct one of them."
        )
    rate = given if given is not None else stated
    if rate is None or not np.isfinite(rate) or rate <= 0.0:
        raise RecordingError(
            f"{where}: the sampling rate {rate} Hz is not a positive number. Give rate."
        )
    return float(rate)


def _from_functions(
    contents: Contents, wanted: Sequence[Wanted], origin: Origin, rate: float | None
) -> TimeBlocks:
    """Universal files: function types 0 and 1 in the order of ``column``; channels from the headers
    when none are declared."""
    functions = [f for f in contents.functions if f.kind in (0, 1)]
    where = contents.file
    if not functions:
        kinds = sorted({f.kind for f in contents.functions})
        raise RecordingError(
            f"{where}: it holds no time history (function type 1), only types {kinds}. "
            "An FRF (type 4) needs "
            'kind = "frf".'
        )
    chosen: list[Function] = []
    channels: list[Channel] = []
    if not wanted:
        for place, f in enumerate(functions):
            if not f.response.dof:
                raise RecordingError(
                    f"{where}: data set {place} does not say its direction. Declare the channels."
                )
            chosen.append(f)
            channels.append(
                Channel(
                    f.response.node, f.response.dof, f.quantity, f.unit, f.scale * f.response.sign
                )
            )
    for want in wanted:
        if isinstance(want.column, str) or not 0 <= want.column < len(functions):
            raise RecordingError(
                f"{where}: {want.label}: there is no such time history; it holds "
                f"{len(functions)} (0 to {len(functions) - 1})."
            )
        f = functions[want.column]
        if f.quantity != "unknown" and want.quantity not in (f.quantity, "unknown", "voltage"):
            raise RecordingError(
                f"{where}: {want.label}: the file says that this channel is {f.quantity}. "
                "Correct the one that is wrong."
            )
        if (
            f.response.dof
            and want.dof
            and f.response.node
            and (f.response.node, f.response.dof) != (want.node, want.dof)
        ):
            raise RecordingError(
                f"{where}: {want.label}: the file says that this channel is at "
                f"n{f.response.node}.{f.response.dof}. Correct the one that is wrong."
            )
        chosen.append(f)
        if want.unit or want.sensitivity is not None:
            channels.append(channel_of(contents, want))
        # a negative direction in the file and a sign in the problem file are two statements, and
        # both hold
        else:
            channels.append(
                Channel(
                    want.node,
                    want.dof,
                    want.quantity,
                    f.unit,
                    f.scale * f.response.sign * want.sign,
                )
            )
    lengths = {f.values.shape[0] for f in chosen}
    rates = [
        1.0 / f.step
        if f.abscissa is None
        else rate_of_times(np.asarray(f.abscissa, dtype=float), where)
        for f in chosen
    ]
    if len(lengths) != 1 or max(rates) > 1.0001 * min(rates):
        raise RecordingError(
            f"{where}: its channels do not have one length and rate (lengths "
            f"{sorted(lengths)}, rates {min(rates):g} to {max(rates):g} Hz). Export channels "
            "that were sampled together."
        )
    if any(f.values.dtype.kind == "c" for f in chosen):
        raise RecordingError(
            f"{where}: a time history of it is complex. Export it as real numbers."
        )
    samples = lengths.pop()
    scales = np.array([channel.scale for channel in channels])

    def pieces(size: int) -> Iterator[Real]:
        for at in range(0, samples, size):
            yield (
                np.stack(
                    [np.asarray(f.values[at : at + size], dtype=float) for f in chosen], axis=1
                )
                * scales
            )
            release(*(f.values for f in chosen))

    return TimeBlocks(origin, _rate(rate, rates[0], where), tuple(channels), samples, pieces)


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
    where = contents.file
    names = names or Names()
    if contents.functions:
        blocks = _from_functions(contents, wanted, origin, rate)
    else:
        if not wanted:
            table = table_of(contents, names)
            count = f" It has {table.shape[1]} columns." if table is not None else ""
            raise RecordingError(
                f"{where}: its channels are not declared.{count} Give channels; `cvxupdate "
                "inspect` prints a block."
            )
        columns = [
            values_of(contents, names, want.column, want.index, want.label) for want in wanted
        ]
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
        stated = contents.rate
        if time_column is not None:
            column = values_of(contents, names, time_column)
            stated = rate_of_times(
                column
                if column.dtype.kind in "iuf"
                else real_values(column, f"{where}: time_column"),
                where,
            )
        elif "rate" in names.given:
            value = contents.arrays.get(names["rate"])
            if value is None or value.size != 1:
                raise RecordingError(
                    f"{where}: {names['rate']!r} is not a single number that could be the rate."
                )
            stated = float(np.real(value.ravel()[0]))
        scales = np.array([channel.scale for channel in channels])

        def pieces(size: int) -> Iterator[Real]:
            for at in range(0, columns[0].shape[0], size):
                yield (
                    np.stack(
                        [np.asarray(np.real(c[at : at + size]), dtype=float) for c in columns],
                        axis=1,
                    )
                    * scales
                )
                release(*columns)

        blocks = TimeBlocks(
            origin, _rate(rate, stated, where), channels, columns[0].shape[0], pieces
        )
    if start == 0 and stop is None:
        return blocks
    first, last, _ = slice(start, stop).indices(blocks.samples)
    if last - first < 2:
        raise RecordingError(
            f"{where}: samples {start} to {stop} leave nothing of {blocks.samples}."
        )

    def cut(size: int) -> Iterator[Real]:
        at = 0
        for piece in blocks.pieces(size):
            inside = piece[max(first - at, 0) : max(last - at, 0)]
            at += len(piece)
            if len(inside):
                yield inside

    return TimeBlocks(origin, blocks.rate, blocks.channels, last - first, cut)


def gather(blocks: TimeBlocks, told: Told | None = None) -> TimeHistory:
    """All blocks as one `TimeHistory`, (samples, channels), filled piece by piece so that nothing
    is held twice."""
    data = np.empty((blocks.samples, len(blocks.channels)))
    at = 0
    for piece in blocks.pieces(2**16):
        data[at : at + len(piece)] = piece
        at += len(piece)
        if told is not None and at % _BLOCK < len(piece) and blocks.samples > _BLOCK:
            told(f"reading {blocks.origin.name}", at, blocks.samples)
    return TimeHistory(blocks.origin, blocks.rate, blocks.channels, data)
