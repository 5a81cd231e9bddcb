"""Measured natural frequencies beside a model's: pairs whose shapes agree, whatever their
frequencies, or all in their order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.mac import mac
from cvxupdate.correlate.response_error import places
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable

ALIKE = 0.8
"""MAC from which on two shapes are one mode's."""
STRAY = 0.25
"""Deviation of ln(f/fₓ) among modes paired by their order above which the order is not trusted."""
EXTRA = 8
"""Modes of the model beyond the number measured that may be partners."""


@dataclass(frozen=True)
class Table:
    """A table of modes, and the places of its channels (channels,)."""

    name: str
    table: ModeTable

    def logs(self, modes: Modes, model: Model) -> Real:
        """ln(f / fₓ) of every pair of a mode of the model and a measured one; empty where they
        cannot be paired."""
        own, measured = modes.flexible(), self.table.frequency
        found = self._by_shape(own, model)
        if len(found) < 2:
            order = np.argsort(measured)
            count = min(len(own.frequencies), len(measured))
            found = np.log(own.frequencies[:count] / measured[order][:count])
            if count < 2 or np.max(np.abs(found - np.median(found))) > STRAY:
                return np.zeros(0)
        return found

    def _by_shape(self, own: Modes, model: Model) -> Real:
        shapes = self.table.shapes
        if shapes is None or not len(self.table.channels):
            return np.zeros(0)
        rows = places(model, self.table.channels)
        seen = (rows >= 0) & np.all(np.isfinite(shapes), axis=0)
        if np.count_nonzero(seen) < 3:
            return np.zeros(0)
        alike = mac(own.shapes[rows[seen]], shapes[:, seen].T)
        best = np.argmax(alike, axis=0)
        good = (alike[best, np.arange(len(best))] > ALIKE) & (np.bincount(best)[best] == 1)
        f = self.table.frequency[good]
        return np.asarray(np.log(own.frequencies[best[good]] / f))


def modes_of(model: Model, tables: list[Table]) -> Modes | None:
    """As many modes of the model as the tables may be paired with; None where it has none."""
    try:
        return model_modes(model, max(len(t.table.frequency) for t in tables) + EXTRA)
    except ModelError:
        return None
