"""Effects on whole members, followed by continuation through several sizes: a derivative says
little of them where the model is far off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.fits import in_few
from cvxupdate.diagnose.modes.setting import setting_of
from cvxupdate.diagnose.settings import WHOLES
from cvxupdate.diagnose.types import Real, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis.space import Space
from cvxupdate.physics.effect import Effect
from cvxupdate.residual.modal import ModalPoint

TRACED = 24  # followed: the largest members first
SIZES = (0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 2.0, 4.0)  # of their parameter, on each side


def whole_members(parent: Fit, effects: Sequence[Effect], space: Space | None = None) -> list[Seed]:
    """Seeds of the effects of one parameter on whole groups that fit best at some size; tried in
    few coordinates where the nominal model has a ``space``."""
    able = [e for e in effects if e.place.groups and e.count == 1 and e.change is not None]
    found: list[tuple[float, Seed]] = []
    for e in sorted(able, key=lambda e: -len(e.place.elements))[:TRACED]:
        best = None if e.change is None else _best(parent, e, e.change.model, space)
        found += [] if best is None else [best]
    return [seed for _, seed in sorted(found, key=lambda item: item[0])[:WHOLES]]


def _best(
    parent: Fit, effect: Effect, model: Model, space: Space | None
) -> tuple[float, Seed] | None:
    """(weighted squares, seed) of the best size, the modes followed from size to size; None where
    there is no structure at any."""
    q, own = model.parameters[len(parent.p)], np.zeros(effect.columns - 1)
    best: tuple[float, Real] | None = None
    try:
        setting = setting_of(model, parent.setting.tables, parent.setting.residual)
        small = in_few(setting, space)
    except CvxupdateError:
        return None
    tried = setting if small is None else small[0]
    for side in (-1.0, 1.0):
        point: ModalPoint | None = None
        for size in [side * x for x in SIZES if q.lower < side * x < q.upper]:
            start = np.array([*parent.p, size, *own])
            try:
                point = tried.residual.evaluate(start, point)
            except CvxupdateError:
                break
            values, weights, _ = point.differences
            squares = float(np.sum((weights * values) ** 2))
            if best is None or squares < best[0]:
                best = squares, start
    if best is None:
        return None
    return best[0], Seed((effect,), replace(setting, level=0), best[1], continued=True)
