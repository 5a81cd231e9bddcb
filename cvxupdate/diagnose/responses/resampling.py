"""Random halves of the rows of recordings of responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.responses.signals import Signal

PAIRS = 6  # of complementary halves


BLOCKS = 8  # of frequency in each recording


SEED = 20100


def halves(signals: Sequence[Signal]) -> list[NDArray[np.bool_]]:
    """Random halves of the rows with their complements: blocks of frequency of each sensor and
    recording, real and imaginary parts together."""
    rng = np.random.default_rng(SEED)
    labels: list[NDArray[np.int64]] = []
    count = 0
    for signal in signals:
        rows, sensors, cases = signal.Y.shape
        block = np.minimum(np.arange(rows) * BLOCKS // max(rows, 1), BLOCKS - 1)
        label = (
            count
            + (block[:, None, None] * sensors + np.arange(sensors)[None, :, None])
            + np.zeros((1, 1, cases), dtype=np.int64)
        )
        labels += [label.reshape(-1)] * 2
        count += BLOCKS * sensors
    of = np.concatenate(labels)
    out = []
    for _ in range(PAIRS):
        half = rng.permutation(count) < count // 2
        out += [half[of], ~half[of]]
    return out
