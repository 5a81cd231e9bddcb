"""Medians of levels, band by band, all bands at once."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.correlate.plausible.levels import Levels
from cvxupdate.recordings.measured import Measured

NOTHING = Measured(np.zeros(0), np.zeros(0), np.zeros(0), "acceleration", (), (), None)


@pytest.mark.parametrize("seed", range(5))
def test_medians_are_those_of_each_band(seed: int) -> None:
    """NaN where half of a band's points or more are; bands of different lengths."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 6, size=7)
    band = np.repeat(np.arange(len(sizes)), sizes)
    log = rng.normal(size=(len(band), 3, 2))
    log[rng.random(log.shape) < 0.3] = np.nan
    found = Levels("some", NOTHING, log, band, False).medians(log)
    assert found.shape == (len(sizes), 6) and np.any(np.isnan(found))
    for b in range(len(sizes)):
        for k, values in enumerate(log[band == b].reshape(sizes[b], 6).T):
            known = values[np.isfinite(values)]
            if 2 * len(known) > len(values):
                assert found[b, k] == pytest.approx(np.median(known), rel=1e-15)
            else:
                assert np.isnan(found[b, k])
