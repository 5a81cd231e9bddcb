"""What the page draws of tables of modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.common import unlike
from cvxupdate.diagnose.shown import ModeError, Shown, places
from cvxupdate.physics.effect import Effect
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.pairing import GROSS


def modes_shown(
    before: ModalPoint,
    after: ModalPoint,
    measured: Sequence[ModeTable],
    scores: Sequence[tuple[Effect, float]] = (),
) -> Shown:
    """From the comparison with mode tables before and after: the file's model beside what was
    ``measured``, the diagnosed one beside that without the mesh's error."""
    out = []
    for k, (own, table) in enumerate(zip(measured, after.residual.tables, strict=True)):
        f, g = (point.frequencies(k) for point in (before, after))
        rows = zip(own.frequency, table.frequency, f, g, strict=True)
        out += [
            ModeError(float(raw), table.origin.use, float(a / raw - 1.0), float(b / x - 1.0))
            for raw, x, a, b in rows
        ]
    return Shown((), (), tuple(out), *places(scores))


def with_counterparts(point: ModalPoint) -> ModalPoint:
    """Without the pairs that are none: what a model has no mode for (one that came with a hidden
    oscillator) was paired by elimination, with a mode that is far off and looks like another."""
    places = [at.copy() for at in point.places]
    for k, table in enumerate(point.residual.tables):
        ratios = point.frequencies(k) / table.frequency
        for i in np.flatnonzero(places[k] >= 0).tolist():
            far = not np.exp(-GROSS) <= ratios[i] <= np.exp(GROSS)
            if far and unlike(table, i, int(places[k][i]), point):
                places[k][i] = -1
    return replace(point, places=tuple(places))
