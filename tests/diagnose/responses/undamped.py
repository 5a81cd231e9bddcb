"""The nominal model at no damping, where modes that cross keep it in common."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.physics import candidates_of

UNDAMPED = -30.0  # logarithm of the factor on all damping ratios: none is left


def without_damping(start, model, signals):
    """The nominal model, no damping left."""
    setting = setting_for(start, model, signals, 75.0)
    p = np.zeros(len(setting.columns))
    p[len(start.parameters)] = UNDAMPED
    return setting.evaluate(p)


def candidates(context, *names):
    return [c for name in names for c in candidates_of(context, (name,))]
