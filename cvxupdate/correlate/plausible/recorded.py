"""What was read of each recording: so that its author sees whether every column went to its DOF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, Recording
from cvxupdate.spec.bases import base_at
from cvxupdate.spec.model import Base

IMPOSED = "imposed motion"


def recorded(recordings: Sequence[Recording], bases: Sequence[Base] = ()) -> list[dict[str, Any]]:
    """Of each its ``name``, what it ``holds``, in words, and by quantity the labels of its
    ``channels``; of responses those of the inputs under "per force", or "per imposed motion" where
    all of them move ``bases``."""
    return [
        {
            "name": r.origin.name,
            "use": r.origin.use,
            "holds": _holds(r) + _level(r),
            "channels": _channels(r, bases),
        }
        for r in recordings
    ]


def _level(r: Recording) -> str:
    return "" if r.origin.level is None else f", level {r.origin.level:.4g}"


def _holds(r: Recording) -> str:
    if isinstance(r, ModeTable):
        shaped = "with" if r.shapes is not None else "without"
        modes = f"{len(r.frequency)} mode{'s' if len(r.frequency) != 1 else ''}"
        band = _band(float(r.frequency.min()), float(r.frequency.max()))
        return f"{modes} from {band}, {shaped} shapes"
    if isinstance(r, FrequencyResponse):
        band = _band(float(r.frequency[0]), float(r.frequency[-1]))
        return f"{len(r.frequency)} lines from {band}"
    return f"{len(r.data) / r.rate:.4g} s at {r.rate:.5g} Hz"


def _band(low: float, high: float) -> str:
    return f"{low:.5g} to {high:.5g} Hz"


def _channels(r: Recording, bases: Sequence[Base]) -> dict[str, list[str]]:
    if isinstance(r, FrequencyResponse):
        per = "force"
        if all(_quantity(c, bases) == IMPOSED for c in r.references):
            per = IMPOSED
        return {r.quantity: _labels(r.responses), f"per {per}": _labels(r.references)}
    if isinstance(r, ModeTable) and r.shapes is None:
        return {}
    by: dict[str, list[Channel]] = {}
    for c in r.channels:
        by.setdefault(_quantity(c, bases), []).append(c)
    return {quantity: _labels(some) for quantity, some in by.items()}


def _quantity(c: Channel, bases: Sequence[Base]) -> str:
    """Of a channel as its author knows it: a motion that is the input was read as the force that
    it takes (`cvxupdate.recordings.imposed`)."""
    moved = c.quantity == "force" and base_at(bases, c.node, c.dof) is not None
    return IMPOSED if moved else c.quantity


def _labels(channels: Sequence[Channel]) -> list[str]:
    return [c.label for c in channels]
