"""Motions that are the input, as forces on the bases that they move (`cvxupdate.spec.bases`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import make_interp_spline

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Channel, FrequencyResponse, Real, Recording, TimeHistory
from cvxupdate.spec.bases import MOTION, base_at, imposed_at
from cvxupdate.spec.model import Base
from cvxupdate.spec.recordings import Recording as Declared

DEGREE = 5
"""Of the spline through the samples whose derivative an acceleration is: of a sine with ten samples
to a period the second derivative is right to 0.1 %."""


def driven_by_motion(recording: Recording, declared: Declared, bases: Sequence[Base]) -> Recording:
    """The recording with a force m a in place of every motion that it imposes: a the acceleration,
    m the mass of the base.

    Accelerations are taken as they are. From displacements and velocities they follow exactly in
    FRFs (a line at 0 Hz has none and is left out), in time histories by a spline through the
    samples. A base without a mass leaves the channel as it is.

    Raises
    ------
    RecordingError
        Where a record is too short to be differentiated.
    """
    if isinstance(recording, FrequencyResponse):
        return _frf(recording, bases)
    return _time(recording, declared, bases) if isinstance(recording, TimeHistory) else recording


def _mass(bases: Sequence[Base], channel: Channel) -> float | None:
    base = base_at(bases, channel.node, channel.dof)
    return None if base is None else base.mass


def _frf(frf: FrequencyResponse, bases: Sequence[Base]) -> FrequencyResponse:
    moved = {
        k: mass
        for k, c in enumerate(frf.references)
        if c.quantity in MOTION and (mass := _mass(bases, c)) is not None
    }
    if not moved:
        return frf
    orders = {k: 2 - MOTION.index(frf.references[k].quantity) for k in moved}
    keep = frf.frequency > 0.0 if any(orders.values()) else np.ones(len(frf.frequency), dtype=bool)
    s = 2j * np.pi * frf.frequency[keep]
    per_force = np.ones((len(s), 1, len(frf.references)), dtype=complex)
    for k, mass in moved.items():
        per_force[:, 0, k] = 1.0 / (mass * s ** orders[k])
    references = tuple(
        replace(c, quantity="force") if k in moved else c for k, c in enumerate(frf.references)
    )
    return replace(
        frf,
        frequency=frf.frequency[keep],
        H=frf.H[keep] * per_force,
        references=references,
        variance=None if frf.variance is None else frf.variance[keep] * np.abs(per_force) ** 2,
        coherence=None if frf.coherence is None else frf.coherence[keep],
    )


def _time(history: TimeHistory, declared: Declared, bases: Sequence[Base]) -> TimeHistory:
    places = set(imposed_at(declared))
    rows = declared.channels or ()
    channels, data = list(history.channels), history.data
    for k, (row, channel) in enumerate(zip(rows, history.channels, strict=False)):
        mass = _mass(bases, channel)
        if not row.imposed or (channel.node, channel.dof) not in places or mass is None:
            continue
        data = data.copy() if data is history.data else data
        data[:, k] = mass * _acceleration(data[:, k], channel, history)
        channels[k] = replace(channel, quantity="force")
    return replace(history, channels=tuple(channels), data=data)


def _acceleration(x: Real, channel: Channel, history: TimeHistory) -> Real:
    order = 2 - MOTION.index(channel.quantity)
    if order == 0:
        return x
    if len(x) <= DEGREE:
        raise RecordingError(
            f"{history.origin.source}: channel {channel.label} ({channel.quantity}): {len(x)} "
            f"samples are too few to differentiate. Give more than {DEGREE}."
        )
    t = np.arange(len(x)) / history.rate
    return np.asarray(make_interp_spline(t, x, DEGREE).derivative(order)(t))
