"""Whether a recording fits the model: its channels have a place, its values are numbers."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import (
    Channel,
    FrequencyResponse,
    ModeTable,
    Recording,
    TimeHistory,
)


def _channels(recording: Recording) -> tuple[Channel, ...]:
    if isinstance(recording, FrequencyResponse):
        return (*recording.responses, *recording.references)
    return recording.channels


def check_fit(recording: Recording, nodes: frozenset[int] | None, dofs: tuple[str, ...]) -> None:
    """Every channel sits at a node and an active DOF of the model, and every value is a number.

    ``nodes`` is None where the text does not know them all (matrices of another program bring their
    own).

    Raises `RecordingError` naming the file, the channel and what the model has. Channels of
    quantity voltage or unknown need no place.
    """
    where = recording.origin.source
    for channel in _channels(recording):
        if not channel.dof and channel.quantity in ("voltage", "unknown"):
            continue
        if nodes is not None and channel.node not in nodes:
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}): the model has no "
                f"node {channel.node}. Correct the channel, add the node to the model, or say "
                f"with node_map = {{ {channel.node} = … }} which node of the model it is."
            )
        if channel.dof not in dofs:
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}): the model's active "
                f"DOFs are {', '.join(dofs)}. Add {channel.dof!r} to model.dofs, or leave the "
                "channel out."
            )
    if isinstance(recording, ModeTable):
        return
    values = recording.H if isinstance(recording, FrequencyResponse) else recording.data
    responses = (
        recording.responses if isinstance(recording, FrequencyResponse) else recording.channels
    )
    for column, channel in enumerate(responses):
        bad = ~np.isfinite(values[:, column]).reshape(len(values), -1).all(axis=1)
        count = int(np.count_nonzero(bad))
        if count:
            what = (
                "a value that is not a number"
                if count == 1
                else f"{count} values that are not numbers"
            )
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}) has {what}, the first "
                f"{_where(recording, int(np.argmax(bad)))}. Cut the record before or after "
                'them (start, stop, band), or leave the channel out (of FRFs: damaged = "leave-out"'
                " leaves out those lines)."
            )


def _where(recording: FrequencyResponse | TimeHistory, row: int) -> str:
    if isinstance(recording, FrequencyResponse):
        return f"at {recording.frequency[row]:.5g} Hz"
    return f"at {row / recording.rate:.5g} s (sample {row})"
