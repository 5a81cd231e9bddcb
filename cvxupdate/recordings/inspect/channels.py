"""Channels as they lie in a file: guessed quantity, level, faults, dominant lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.inspect.result import ChannelView
from cvxupdate.recordings.lines import dominant_lines
from cvxupdate.recordings.quality import samples
from cvxupdate.recordings.read.contents import AnyArray, Progress
from cvxupdate.recordings.survey import LONG, Survey, survey
from cvxupdate.recordings.types import Real

_QUANTITIES = (
    ("force", "force"),
    ("load", "force"),
    ("hammer", "force"),
    ("acc", "acceleration"),
    ("vel", "velocity"),
    ("disp", "displacement"),
    ("strain", "strain"),
    ("volt", "voltage"),
)
_BY_UNIT = {
    "g": "acceleration",
    "m/s^2": "acceleration",
    "m/s²": "acceleration",
    "m/s2": "acceleration",
    "N": "force",
    "Newtons": "force",
    "lbf": "force",
    "kip": "force",
    "m": "displacement",
    "mm": "displacement",
    "in": "displacement",
    "m/s": "velocity",
    "V": "voltage",
}


def guessed_quantity(name: str, unit: str, kind: str = "") -> str:
    """From a part of the channel's name, else from its unit, else ``kind``."""
    for part, quantity in _QUANTITIES:
        if part in name.lower():
            return quantity
    return _BY_UNIT.get(unit, kind or "unknown")


@dataclass(frozen=True)
class Column:
    """A channel to look at: what is known of it, and its values, which may lie on disk."""

    name: str
    unit: str
    quantity: str
    values: AnyArray
    place: str = ""


def channel_views(
    columns: Sequence[Column], rate: float, progress: Progress | None = None
) -> tuple[ChannelView, ...]:
    """Level, faults and lines of equally long channels; a complex one by its modulus. Long ones are
    looked at in blocks."""
    if columns and len(columns[0].values) > LONG:
        seen = survey([c.values for c in columns], rate, progress, "inspecting the channels")
    else:
        seen = tuple(survey_whole(c.values, rate) for c in columns)
    return tuple(
        ChannelView(
            c.name,
            c.unit,
            c.quantity,
            s.mean,
            s.rms,
            s.least,
            s.largest,
            s.missing,
            s.clipped,
            s.dropped,
            s.lines,
            c.place,
        )
        for c, s in zip(columns, seen, strict=True)
    )


@np.errstate(over="ignore")  # a flipped bit may read 1e300
def survey_whole(x: AnyArray, rate: float) -> Survey:
    """A channel that is short enough to be looked at as a whole."""
    values: Real = np.asarray(np.abs(x) if x.dtype.kind == "c" else x, dtype=float)
    bad = samples.missing(values)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return Survey(*(float("nan"),) * 4, bad, 0, 0, ())
    clip, drop = (
        (samples.clipping(values), samples.dropouts(values))
        if values.size >= 16 and np.ptp(values) > 0.0
        else (None, None)
    )
    lines = dominant_lines(values, rate) if np.isfinite(rate) else ()
    return Survey(
        float(np.mean(values)),
        float(np.std(values)),
        float(values.min()),
        float(values.max()),
        bad,
        int(clip.value) if clip is not None and clip.fault else 0,
        int(drop.value) if drop is not None and drop.fault else 0,
        lines,
    )
