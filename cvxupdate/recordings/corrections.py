"""Faults of channels taken out of a recording: gain, delay, two channels exchanged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import (
    Channel,
    FrequencyResponse,
    ModeTable,
    Real,
    Recording,
    TimeHistory,
)
from cvxupdate.spec.recordings import CorrectionRow

# lengths of a record over which it is shifted, so that its end does not come round to its beginning
PADDING = 2


def corrected(recording: Recording, corrections: Sequence[CorrectionRow]) -> Recording:
    """The recording as sound channels would have given it; what is exchanged stays in its column,
    with the other's label.

    Raises
    ------
    RecordingError
        When there is no such channel.
    """
    for row in corrections:
        if row.quantity == "force":
            recording = _driven(recording, row)
            continue
        own = _columns(recording, row.node, row.dof)
        if row.exchanged_with is not None:
            recording = _exchanged(
                recording, own, _columns(recording, row.exchanged_with.node, row.exchanged_with.dof)
            )
        elif row.delay is not None:
            recording = _advanced(recording, own, row.delay)
        elif row.gain is not None:
            recording = _scaled(recording, own, 1.0 / row.gain)
    return recording


def _channels(recording: Recording) -> tuple[Channel, ...]:
    return recording.responses if isinstance(recording, FrequencyResponse) else recording.channels


def _columns(recording: Recording, node: int, dof: str) -> list[int]:
    found = [
        k
        for k, c in enumerate(_channels(recording))
        if (c.node, c.dof) == (node, dof) and c.quantity != "force"
    ]
    if not found:
        there = ", ".join(c.label for c in _channels(recording) if c.quantity != "force")
        raise RecordingError(
            f"{recording.origin.source}: corrections: there is no response channel "
            f"n{node}.{dof}. It has {there}."
        )
    return found


def _driven(recording: Recording, row: CorrectionRow) -> Recording:
    """With the gain of a force channel taken out: responses to it are that much larger."""
    refs = (
        recording.references if isinstance(recording, FrequencyResponse) else _channels(recording)
    )
    own = [
        k for k, c in enumerate(refs) if (c.node, c.dof, c.quantity) == (row.node, row.dof, "force")
    ]
    if not own or row.gain is None:
        raise RecordingError(
            f"{recording.origin.source}: corrections: there is no force channel "
            f"n{row.node}.{row.dof} with a gain to take out."
        )
    if isinstance(recording, FrequencyResponse):
        H, variance = recording.H.copy(), recording.variance
        H[:, :, own] *= row.gain
        if variance is not None:
            variance = variance.copy()
            variance[:, :, own] *= row.gain**2
        return replace(recording, H=H, variance=variance)
    return _scaled(recording, own, 1.0 / row.gain)


def _exchanged(recording: Recording, first: list[int], second: list[int]) -> Recording:
    channels = list(_channels(recording))
    for a, b in zip(first, second, strict=False):
        one, other = channels[a], channels[b]
        channels[a], channels[b] = (
            replace(one, node=other.node, dof=other.dof),
            replace(other, node=one.node, dof=one.dof),
        )
    if isinstance(recording, FrequencyResponse):
        return replace(recording, responses=tuple(channels))
    return replace(recording, channels=tuple(channels))


def _scaled(recording: Recording, columns: list[int], factor: float) -> Recording:
    if isinstance(recording, TimeHistory):
        data = recording.data.copy()
        data[:, columns] *= factor
        return replace(recording, data=data)
    if isinstance(recording, ModeTable):
        if recording.shapes is None:
            return recording
        shapes, std = recording.shapes.copy(), recording.shape_std
        shapes[:, columns] *= factor
        if std is not None:
            std = np.broadcast_to(std, shapes.shape).copy()
            std[:, columns] *= abs(factor)
        C, (count, width) = recording.covariance, shapes.shape
        if C is not None and len(C) > count:
            rates = np.ones((count, width))
            rates[:, columns] = factor
            every = np.concatenate([np.ones(count), rates.ravel()])
            C = C * np.outer(every, every)
        return replace(recording, shapes=shapes, shape_std=std, covariance=C)
    H, variance = recording.H.copy(), recording.variance
    H[:, columns] *= factor
    if variance is not None:
        variance = variance.copy()
        variance[:, columns] *= factor**2
    return replace(recording, H=H, variance=variance)


def _advanced(recording: Recording, columns: list[int], delay: float) -> Recording:
    if isinstance(recording, FrequencyResponse):
        H = recording.H.copy()
        H[:, columns] *= np.exp(2j * np.pi * recording.frequency * delay)[:, None, None]
        return replace(recording, H=H)
    if isinstance(recording, TimeHistory):
        data = recording.data.copy()
        data[:, columns] = shifted(data[:, columns], recording.rate, delay)
        return replace(recording, data=data)
    return recording


def shifted(data: Real, rate: float, delay: float) -> Real:
    """Signals (samples, channels) earlier by ``delay`` s: exact for what is band-limited and at
    rest at both ends."""
    n = len(data)
    spectrum = np.fft.rfft(data, PADDING * n, axis=0)
    f = np.fft.rfftfreq(PADDING * n, 1.0 / rate)
    return np.asarray(
        np.fft.irfft(spectrum * np.exp(2j * np.pi * f * delay)[:, None], PADDING * n, axis=0)[:n]
    )
