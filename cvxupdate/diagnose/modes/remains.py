"""Which modes a model leaves unexplained."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.settings import LEAST_SIZE
from cvxupdate.physics.place import listed
from cvxupdate.residual.modal import ModalPoint

MODES = 3  # that are named


def remains(point: ModalPoint) -> str:
    """The fitted modes whose frequencies are off by more than two deviations, in words, farthest
    first; empty where none is."""
    off: list[tuple[float, str]] = []
    for k, table in enumerate(point.residual.fit):
        gap = point.frequencies(k) / table.frequency - 1.0
        size = np.abs(gap) * table.frequency / table.frequency_std
        off += [
            (float(z), f"{table.frequency[i]:.4g} Hz ({100 * gap[i]:+.2g} %)".replace("-", "−"))
            for i, z in enumerate(size)
            if np.isfinite(z) and z > LEAST_SIZE
        ]
    if not off:
        return ""
    names = [name for _, name in sorted(off, key=lambda item: -item[0])]
    return f"What is left is mostly at {listed(names, MODES)} (model against measured)."
