"""What no hypothesis may rest on: a size on its bound, or one that is hardly there."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.confidence import size_of
from cvxupdate.diagnose.settings import AT_BOUND, LEAST_SIZE
from cvxupdate.fe.parameters import Parameter


def sound(h: Hypothesis) -> bool:
    """Whether every effect's first unknown is off its bounds and at least `LEAST_SIZE` of its
    standard deviations from nothing; an exchange of channels has no size."""
    fit, at = h.fit, len(h.fit.setting.model.parameters) - sum(e.columns for e in h.effects)
    for effect, figures in zip(h.effects, h.figures, strict=True):
        if effect.change is None:
            if size_of(effect, figures) < LEAST_SIZE:
                return False
        else:
            p, q = float(fit.p[at]), fit.setting.model.parameters[at]
            if on_bound(p, q) or abs(p) < LEAST_SIZE * float(fit.deviations[at]):
                return False
        at += effect.columns
    return True


def on_bound(p: float, q: Parameter) -> bool:
    """Whether a parameter is within `AT_BOUND` of its range from either bound."""
    margin = AT_BOUND * (q.upper - q.lower)
    return bool(np.isfinite(margin) and min(p - q.lower, q.upper - p) <= margin and p != 0.0)
