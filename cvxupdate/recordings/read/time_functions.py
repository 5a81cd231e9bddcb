"""Time histories from the functions of a universal file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Function
from cvxupdate.recordings.read.time_axis import rate_of_times, sampling_rate
from cvxupdate.recordings.read.time_pieces import TimeBlocks, pieces_of
from cvxupdate.recordings.read.wanted import Wanted, channel_of
from cvxupdate.recordings.types import Channel, Origin


def blocks_of_functions(
    contents: Contents, wanted: Sequence[Wanted], origin: Origin, rate: float | None
) -> TimeBlocks:
    """Function types 0 and 1 in the order of ``column``; channels from the headers when none are
    declared. Raises `RecordingError` naming file and channel."""
    where = contents.file
    functions = [f for f in contents.functions if f.kind in (0, 1)]
    if not functions:
        kinds = sorted({f.kind for f in contents.functions})
        raise RecordingError(
            f"{where}: no time history (function type 1) in this file, only types {kinds}. "
            'An FRF (type 4) needs kind = "frf".'
        )
    if wanted:
        chosen = [_chosen(functions, want, where) for want in wanted]
        channels = [_channel(contents, f, w) for f, w in zip(chosen, wanted, strict=True)]
    else:
        chosen = functions
        channels = [_stated_channel(f, k, where) for k, f in enumerate(functions)]
    lengths = {f.values.shape[0] for f in chosen}
    rates = [
        1.0 / f.step
        if f.abscissa is None
        else rate_of_times(np.asarray(f.abscissa, dtype=float), where)
        for f in chosen
    ]
    if len(lengths) != 1 or max(rates) > 1.0001 * min(rates):
        raise RecordingError(
            f"{where}: its channels differ in length or sampling rate (lengths "
            f"{sorted(lengths)}, rates {min(rates):g} to {max(rates):g} Hz). Export channels "
            "that were sampled together."
        )
    if any(f.values.dtype.kind == "c" for f in chosen):
        raise RecordingError(
            f"{where}: one of its time histories is complex. Export it as real numbers."
        )
    return TimeBlocks(
        origin,
        sampling_rate(rate, rates[0], where),
        tuple(channels),
        lengths.pop(),
        pieces_of([f.values for f in chosen], channels),
    )


def _stated_channel(f: Function, number: int, where: str) -> Channel:
    """The channel as the header of the function states it."""
    if not f.response.dof:
        raise RecordingError(f"{where}: data set {number} has no direction. Declare the channels.")
    scale = f.scale * f.response.sign
    return Channel(f.response.node, f.response.dof, f.quantity, f.unit, scale)


def _chosen(functions: Sequence[Function], want: Wanted, where: str) -> Function:
    """The function that a declared channel means; what its header states must not contradict."""
    if isinstance(want.column, str) or not 0 <= want.column < len(functions):
        raise RecordingError(
            f"{where}: {want.label}: no such time history; the file holds "
            f"{len(functions)} (0 to {len(functions) - 1})."
        )
    f = functions[want.column]
    if f.quantity != "unknown" and want.quantity not in (f.quantity, "unknown", "voltage"):
        raise RecordingError(
            f"{where}: {want.label}: the file states that this channel is {f.quantity}. "
            "Correct the one that is wrong."
        )
    place = f.response
    if place.dof and want.dof and place.node and (place.node, place.dof) != (want.node, want.dof):
        raise RecordingError(
            f"{where}: {want.label}: the file states that this channel is at "
            f"n{place.node}.{place.dof}. Correct the one that is wrong."
        )
    return f


def _channel(contents: Contents, f: Function, want: Wanted) -> Channel:
    if want.unit or want.sensitivity is not None:
        return channel_of(contents, want)
    # a negative direction in the file and a sign in the problem file are two statements, and
    # both hold
    scale = f.scale * f.response.sign * want.sign
    return Channel(want.node, want.dof, want.quantity, f.unit, scale)
