"""What was read of each recording: so that its author sees whether every column went to its DOF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, Recording


def recorded(recordings: Sequence[Recording]) -> list[dict[str, Any]]:
    """Of each its ``name``, what it ``holds``, in words, and by quantity the labels of its
    ``channels``; of responses those of the forces under "per"."""
    return [
        {"name": r.origin.name, "use": r.origin.use, "holds": _holds(r), "channels": _channels(r)}
        for r in recordings
    ]


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


def _channels(r: Recording) -> dict[str, list[str]]:
    if isinstance(r, FrequencyResponse):
        return {r.quantity: _labels(r.responses), "per": _labels(r.references)}
    if isinstance(r, ModeTable) and r.shapes is None:
        return {}
    by: dict[str, list[Channel]] = {}
    for c in r.channels:
        by.setdefault(c.quantity, []).append(c)
    return {quantity: _labels(some) for quantity, some in by.items()}


def _labels(channels: Sequence[Channel]) -> list[str]:
    return [c.label for c in channels]
