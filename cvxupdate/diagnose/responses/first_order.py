"""How much of the projected residual every effect at every place could explain, to first order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cvxupdate.diagnose.fit import bounds_of
from cvxupdate.diagnose.responses.columns import Columns, sums_of
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Real
from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.diagnose.settings import AT_BOUND
from cvxupdate.diagnose.types import Score
from cvxupdate.physics.effect import Effect


def linearised(point: Any) -> Linearised:
    """The nuisance parameters at a point; those that have reached a bound take up nothing."""
    A, _ = point.system().weighted()
    values, weights, _ = point.differences
    bounds = bounds_of(point.setting)
    free = (point.p > bounds.lower + AT_BOUND * np.abs(bounds.lower)) & (
        point.p < bounds.upper - AT_BOUND * np.abs(bounds.upper)
    )
    scales = point.setting.scales[free]
    return Linearised(A[:, free], -weights * values, point.p[free], scales)


def first_order(
    point: ResponsePoint, effects: Sequence[Effect], left: Projection | None = None
) -> list[Score]:
    """Scores in the order of ``effects`` (``left``: the projected residual at the point
    where it is at hand)."""
    left = Projection.of(linearised(point)) if left is None else left
    sets = sums_of(effects)
    out = [Score(e, 0.0, np.zeros(e.count)) for e in effects]
    kept: dict[int, tuple[Real, Real]] = {}  # of single elements, as they are and projected
    singles = {k for members in sets.values() for k in members}
    alone = {k: e for k, e in enumerate(effects) if k not in sets}
    for numbers, J in Columns(point).batches(alone):
        Jp = left.freed(J)
        width = J.shape[1] // len(numbers)
        if width == 1:
            chosen = [effects[k] for k in numbers]
            scores = left.one(chosen, Jp.T @ left.residual, norms(Jp), norms(J))
            for k, score in zip(numbers, scores, strict=True):
                out[k] = score
        for i, k in enumerate(numbers):
            own = slice(i * width, (i + 1) * width)
            if width > 1:
                out[k] = left.several(effects[k], J[:, own], Jp[:, own])
            if k in singles:
                kept[k] = J[:, own.start], Jp[:, own.start]
    for k, score in left.sets(effects, sets, kept).items():
        out[k] = score
    return out
