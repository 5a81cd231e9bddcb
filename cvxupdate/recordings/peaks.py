"""Peaks that stand out, without scipy.signal: it takes half a second to import."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[Any]
Index = NDArray[np.intp]


def prominent(level: Real, least: float) -> tuple[Index, Real]:
    """Places (peaks,) of the local maxima of ``level`` (samples,), finite, that stand out by at
    least ``least``, ascending, and by how much each does (peaks,).

    A maximum stands out by its height over the higher of the two deepest points that lie between it
    and something higher, or an end, on either side. A plateau counts at its middle; ends do not
    count. As scipy.signal.find_peaks.
    """
    change = np.flatnonzero(np.diff(level))
    starts = np.concatenate([[0], change + 1])  # runs of equal values
    ends = np.concatenate([change, [len(level) - 1]])
    value = level[starts]
    inner = np.arange(1, len(value) - 1)
    top = inner[(value[inner] > value[inner - 1]) & (value[inner] > value[inner + 1])]
    if not len(top):
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    # The deepest point before the first maximum, between each two, and after the last.
    deep = np.minimum.reduceat(value, np.concatenate([[0], top]))
    height = value[top]
    base = np.maximum(_bases(height, deep[:-1]), _bases(height[::-1], deep[:0:-1])[::-1])
    out = height - base
    keep = out >= least
    return (starts[top] + ends[top])[keep] // 2, out[keep]


def _bases(height: Real, before: Real) -> Real:
    """The deepest point (peaks,) between each maximum and the nearest higher one to its left;
    ``before`` (peaks,) the deepest between it and its neighbour."""
    out = np.empty(len(height))
    higher: list[tuple[float, float]] = []  # what is still in sight: height, its own base
    for k, (top, low) in enumerate(zip(height.tolist(), before.tolist(), strict=True)):
        while higher and higher[-1][0] <= top:
            low = min(low, higher.pop()[1])
        higher.append((top, low))
        out[k] = low
    return out
