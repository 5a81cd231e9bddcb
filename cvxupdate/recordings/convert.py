"""Receptance, mobility, accelerance: one FRF in another quantity, its variance with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, FrequencyResponse, Real

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
_ALIASES = {
    "receptance": "displacement",
    "mobility": "velocity",
    "accelerance": "acceleration",
    "inertance": "acceleration",
}


def derivatives(quantity: str) -> int:
    """How often displacement was differentiated: 0 receptance, 1 mobility, 2 accelerance.

    Raises
    ------
    RecordingError
        When the quantity is not a motion (a strain or a voltage cannot be integrated to a
        displacement).
    """
    name = _ALIASES.get(quantity, quantity)
    if name not in DERIVATIVES:
        raise RecordingError(
            f"FRF quantity {quantity!r} is not a motion; use displacement (receptance), "
            "velocity (mobility) or acceleration (accelerance)"
        )
    return DERIVATIVES[name]


def differentiator(frequency: Real, order: int) -> Complex:
    """``(i omega)**order``, shape (lines,), in (rad/s)**order."""
    return np.asarray((2j * np.pi * frequency) ** order)


def convert(frf: FrequencyResponse, quantity: str) -> FrequencyResponse:
    """The same FRFs as displacement, velocity or acceleration per force (Ewins, *Modal Testing*,
    section 2.2).

    H and its variance are multiplied by ``(i omega)**n`` and ``omega**(2 n)``. A line at 0 Hz is
    dropped when it would have to be divided by zero. The names receptance, mobility and accelerance
    are understood too.
    """
    order = derivatives(quantity) - derivatives(frf.quantity)
    name = _ALIASES.get(quantity, quantity)
    if order == 0:
        return replace(frf, quantity=name)
    keep = frf.frequency > 0.0 if order < 0 else np.ones(frf.frequency.size, dtype=bool)
    factor = differentiator(frf.frequency[keep], order)[:, None, None]
    responses = tuple(replace(channel, quantity=name) for channel in frf.responses)
    return replace(
        frf,
        frequency=frf.frequency[keep],
        H=frf.H[keep] * factor,
        quantity=name,
        responses=responses,
        variance=None if frf.variance is None else frf.variance[keep] * np.abs(factor) ** 2,
        coherence=None if frf.coherence is None else frf.coherence[keep],
    )
