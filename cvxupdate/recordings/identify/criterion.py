"""What a mode must gain to be kept: Bayes' information criterion with correlated lines counted
once."""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.uncertainty import line_correlation


def parameters(s: Setting, modes: int) -> tuple[int, int]:
    """Real parameters of one mode, and of the whole model."""
    _, outputs, inputs = s.H.shape
    one = 2 * outputs + 2 + 2 * (inputs - 1)
    return one, one * modes + sum(s.residuals) * outputs * inputs


def worth(s: Setting, fit: LinearFit, gain: float, count: int) -> bool:
    """Bayes' information criterion: does a ``gain`` in (scaled) cost pay for ``count`` parameters?

    Both the gain and the number of data are divided by the correlation of the lines, at most ten:
    beyond that it is misfit.
    """
    correlation = min(line_correlation(s, fit), 10.0)
    return gain / correlation > count * np.log(2.0 * s.H.size / correlation)
