"""The best of several sizes of an effect: from a coarse row to finer ones between the neighbours of
the best."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cvxupdate.diagnose.types import Real

BETWEEN = 4  # sizes tried between the neighbours of the best one
FINER = 2  # of finer sizes


def best_size(
    squares: Callable[[Real], Real], sizes: Real, limit: float = np.inf, rounds: int = FINER
) -> tuple[float, float] | None:
    """(size, squares that remain there) of the best of ``sizes`` (ascending) and of finer ones;
    None where none is below ``limit``. ``squares`` maps sizes (n,) to squares (n,)."""
    found: tuple[float, float] | None = None
    for _ in range(1 + rounds):
        if not len(sizes):
            break
        values = squares(sizes)
        k = int(np.argmin(values))
        if not values[k] < (limit if found is None else found[1]):
            break
        found = float(sizes[k]), float(values[k])
        sizes = between(sizes, k)
    return found


def between(sizes: Real, k: int, count: int = BETWEEN) -> Real:
    """Sizes between the neighbours of the k-th."""
    low, high = sizes[max(k - 1, 0)], sizes[min(k + 1, len(sizes) - 1)]
    return np.linspace(low, high, count + 2)[1:-1]
