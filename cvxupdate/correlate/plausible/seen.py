"""How far a recording is from the model, as it came or with a mistake taken back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.plausible.changes import NONE, Change
from cvxupdate.correlate.plausible.levels import Levels, logs, modelled, shape_of
from cvxupdate.fe.model import Model

GROSS_LEVEL, GROSS_FREQUENCY = float(np.log(2.5)), float(np.log(1.8))
LEFT = 1.0 / 3.0
"""Of the distance at first: what a mistake that is taken back may leave."""
NEAR, CLOSE = 0.25, 0.05
"""Common factor that may be left, in nepers: at most `NEAR`, and `CLOSE` of the logarithm of the
mistake's own factor, for 4.45 must not pass for 5.2."""
SHAPE, FLAT = 0.6, 0.3
"""What may be left beside the shape of the model's levels, and the least shape that tells."""


@dataclass(frozen=True)
class Seen:
    """Differences in nepers (median per band and channel, or per pair of modes) of one recording,
    what its kind calls gross, and the shape behind them."""

    values: Real
    gross: float
    shape: float

    @property
    def distance(self) -> float:
        """The median |difference|, nepers."""
        return float(np.median(np.abs(self.values))) if self.values.size else float("nan")

    @property
    def common(self) -> float:
        """The median difference: the factor that all have in common."""
        return float(np.median(self.values)) if self.values.size else float("nan")

    @property
    def off(self) -> bool:
        """Whether it is grossly off."""
        return self.distance > self.gross


@dataclass(frozen=True)
class Against:
    """A model that levels are held against: its responses are computed once for each recording and
    frequency axis, for most mistakes leave both as they are."""

    model: Model
    _known: dict[tuple[int, float], tuple[Levels, Real | None]] = field(default_factory=dict)

    def logs(self, levels: Levels, axis: float = 1.0) -> Real | None:
        """ln|Y| of the model at the points of ``levels``; None where it has no responses."""
        key = (id(levels), axis)  # the levels are kept beside, so that their id stays theirs
        if key not in self._known:
            Y = modelled(self.model, levels, axis)
            self._known[key] = levels, None if Y is None else logs(Y)
        return self._known[key][1]


def of_levels(levels: Levels, against: Against, change: Change = NONE) -> Seen | None:
    """Levels against those of the model, the recording read with a ``change``; None where fewer
    than six can be compared."""
    own = against.logs(levels, change.axis)
    if own is None:
        return None
    omega = np.log(np.abs(levels.measured.s) * change.axis)[:, None, None]
    more = float(np.log(change.factor)) + change.power * omega
    values = levels.measured_medians - levels.medians(own + more)
    values = values[np.isfinite(values)]
    if values.size < 6:
        return None
    return Seen(values, GROSS_LEVEL, shape_of(levels, own))


def joined(seen: Sequence[Seen]) -> Seen:
    """Several recordings as one."""
    return Seen(
        np.concatenate([s.values for s in seen]),
        min(s.gross for s in seen),
        float(np.median([s.shape for s in seen])),
    )


def explains(now: Seen, before: Seen, size: float) -> bool:
    """Whether a mistake of ``size`` (ln of its factor; infinite for one that moves resonances) that
    was taken back explains the distance."""
    return (
        now.distance < LEFT * before.distance
        and abs(now.common) <= min(NEAR, CLOSE * size)
        and (now.shape == np.inf or (now.shape > FLAT and now.distance < SHAPE * now.shape))
    )
