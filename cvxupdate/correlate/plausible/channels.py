"""Channels that read the wrong way round, stand in each other's place, or do not read at all: the
measured shapes against the model's.

A channel that is turned, or two that are exchanged, are so in every mode. With the channel turned
back the shapes of all modes must agree with the model's, and with no other channel turned nearly as
well: what a structure has and its model lacks bends shapes a little, differently in every mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.frf import Complex
from cvxupdate.correlate.mac import mac
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.correlate.plausible.levels import levels_of, modelled
from cvxupdate.correlate.response_error import places
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.lines import frf_peaks
from cvxupdate.recordings.types import (
    Channel,
    FrequencyResponse,
    ModeTable,
    Recording,
    TimeHistory,
)

PEAKS = 6
"""Resonances of an FRF that are looked at."""
NEAR = float(np.log(1.5))
"""How far a mode of the model may be from the measured one, in nepers of frequency."""
BENT = 0.05
"""1 − MAC (mean) that a sound recording may have: no channel is doubted below it."""
RIGHT = 0.25
"""Of the 1 − MAC at first: what a channel that is put right may leave."""
APART = 2.0
"""How many times more than the best any other channel must leave."""
CHANNELS = 60
"""Channels above which pairs are not tried."""
SILENT = 1e-3
"""Of the largest response of the model: a channel where it has less may be still."""


@dataclass(frozen=True)
class _Shapes:
    """Measured shapes (channels, modes) at ``frequency`` (modes,) Hz, and their channels."""

    name: str
    channels: tuple[Channel, ...]
    frequency: Real
    values: Complex


def channel_doubts(
    model: Model, modes: Modes | None, recordings: Sequence[Recording]
) -> tuple[Doubt, ...]:
    """Channels that are dead, stand twice, are turned or exchanged, recording by recording."""
    found = [d for r in recordings for d in (*_still(model, r), *_twice(r))]
    if modes is not None:
        shapes = (s for r in recordings if (s := _shapes(r)) is not None)
        found += [d for s in shapes for d in _turned(model, modes.flexible(), s)]
    return tuple(found)


def _still(model: Model, recording: Recording) -> Iterator[Doubt]:
    """Channels that read nothing where the model moves: nothing can be said of such a recording
    until they are left out."""
    if isinstance(recording, ModeTable):
        return
    data = recording.H if isinstance(recording, FrequencyResponse) else recording.data
    channels = (
        recording.responses if isinstance(recording, FrequencyResponse) else recording.channels
    )
    data = data.reshape(len(data), len(channels), -1)
    constant = np.all(data == data[:1], axis=(0, 2))
    if isinstance(recording, FrequencyResponse):
        constant &= np.all(data == 0.0, axis=(0, 2))
    if not np.any(constant):
        return
    moving = _moving(model, recording)
    for k in np.flatnonzero(constant).tolist():
        c = channels[k]
        if c.quantity == "force" or (c.node, c.dof, c.quantity) in moving:
            yield Doubt(
                "dead channel",
                f"{recording.origin.name}: channel {c.label} ({c.quantity}) reads "
                f"{np.real(data[0, k, 0]):.3g} throughout: it is dead. Leave the channel out, or "
                'set damaged = "leave-out" in the recording.',
                recording.origin.name,
                c.label,
                fatal=True,
            )


def _twice(recording: Recording) -> Iterator[Doubt]:
    """Two channels of one quantity at one place and direction, of modes or responses: two sensors
    there, or a slip."""
    if isinstance(recording, TimeHistory):
        return
    channels = (
        recording.responses if isinstance(recording, FrequencyResponse) else recording.channels
    )
    seen: dict[tuple[int, str, str], list[int]] = {}
    for number, c in enumerate(channels, 1):
        seen.setdefault((c.node, c.dof, c.quantity), []).append(number)
    for (node, dof, quantity), numbers in seen.items():
        if len(numbers) > 1:
            which = " and ".join(map(str, numbers))
            yield Doubt(
                "channel twice",
                f"{recording.origin.name}: channels {which} are all {quantity} at n{node}.{dof}: "
                "right where so many sensors stood there. Else correct the node or dof of one.",
                recording.origin.name,
                f"n{node}.{dof}",
            )


def _moving(model: Model, recording: FrequencyResponse | TimeHistory) -> set[tuple[int, str, str]]:
    """Responses where the model is not still."""
    out = set()
    for levels in levels_of(recording, every=True):
        Y = modelled(model, levels)
        if Y is None:
            continue
        size = np.sqrt(np.mean(np.abs(Y) ** 2, axis=(0, 2)))
        for c, value in zip(levels.measured.responses, size, strict=True):
            if value > SILENT * size.max():
                out.add((c.node, c.dof, levels.measured.quantity))
    return out


def _shapes(recording: Recording) -> _Shapes | None:
    """Shapes of a table of modes, or what an FRF of one reference is at its highest peaks."""
    if isinstance(recording, ModeTable):
        if recording.shapes is None:
            return None
        whole = np.all(np.isfinite(recording.shapes), axis=1)
        values = np.asarray(recording.shapes[whole].T, dtype=complex)
        f = recording.frequency[whole]
        return _Shapes(recording.origin.name, recording.channels, f, values)
    if not isinstance(recording, FrequencyResponse) or recording.H.shape[2] != 1:
        return None
    motions = [k for k, c in enumerate(recording.responses) if c.dof]
    H = recording.H[:, motions, 0]
    if len(recording.frequency) < 16 or not np.all(np.isfinite(H)):
        return None
    peaks = frf_peaks(recording.frequency, H, PEAKS)
    at = [int(np.argmin(np.abs(recording.frequency - p.frequency))) for p in peaks]
    channels = tuple(recording.responses[k] for k in motions)
    return _Shapes(recording.origin.name, channels, recording.frequency[at], H[at].T)


def _turned(model: Model, modes: Modes, shapes: _Shapes) -> Iterator[Doubt]:
    rows = places(model, shapes.channels)
    seen = np.flatnonzero(rows >= 0)
    if len(seen) < 3 or shapes.values.shape[1] < 2:
        return
    own, phi = modes.shapes[rows[seen]], shapes.values[seen]
    names = [shapes.channels[k].label for k in seen.tolist()]
    near = np.abs(np.log(modes.frequencies[:, None] / shapes.frequency[None, :])) < NEAR
    phi, near = phi[:, np.any(near, axis=0)], near[:, np.any(near, axis=0)]
    if phi.shape[1] < 2:
        return

    def left(values: Complex) -> Real:
        return np.asarray(1.0 - np.max(np.where(near, mac(own, values), 0.0), axis=0))

    before = left(phi)
    if before.mean() < BENT:
        return
    tried = sorted(
        ((float(left(turned).mean()), what, turned) for what, turned in _changes(phi)),
        key=lambda item: item[0],
    )
    if not tried or tried[0][0] > RIGHT * before.mean() or tried[0][0] > BENT:
        return
    best, what, turned = tried[0]
    if len(tried) > 1 and tried[1][0] < APART * best + 0.2 * BENT:
        return
    if np.any(left(turned) > before + 0.02):
        return
    yield _doubt(shapes.name, sorted(names[k] for k in what), len(before))


def _changes(phi: Complex) -> Iterator[tuple[tuple[int, ...], Complex]]:
    """Every channel turned, every two exchanged."""
    count = len(phi)
    for i in range(count):
        turned = phi.copy()
        turned[i] *= -1.0
        yield (i,), turned
    if count <= CHANNELS:
        for i in range(count):
            for j in range(i):
                order: NDArray[np.int64] = np.arange(count)
                order[[i, j]] = j, i
                yield (j, i), phi[order]


def _doubt(recording: str, names: Sequence[str], modes: int) -> Doubt:
    if len(names) == 1:
        return Doubt(
            "sign of a channel",
            f"{recording}: channel {names[0]} reads the wrong way round: turned, the shapes of "
            f"{modes} modes agree with the model's. Set sign = -1, or correct its direction.",
            recording,
            names[0],
            -1.0,
        )
    return Doubt(
        "exchanged channels",
        f"{recording}: channels {names[0]} and {names[1]} seem to be exchanged: the other way "
        f"round, the shapes of {modes} modes agree with the model's. Check cables and labels.",
        recording,
        f"{names[0]}, {names[1]}",
    )
