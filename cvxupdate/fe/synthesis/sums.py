"""Sums of element matrices in a space of few shapes, and weighted sums of many of these, as one
product."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cvxupdate.fe.elements.base import Real

APART = 3  # rows without a weight between two with one, from which on they are not read


@dataclass(frozen=True)
class Sums:
    """Symmetric matrices Σ Vᵀ T V ``terms`` (n, r, r) in r shapes, and what k shapes that came
    later make of them, their last columns ``further`` (n, r + k, k); None: there are none."""

    terms: Real = field(repr=False)
    further: Real | None = field(default=None, repr=False)

    def add(self, out: Real, weights: Real) -> None:
        """Σ wᵢ Tᵢ to ``out`` (r + k, r + k), in place; ``weights`` (n,)."""
        r = self.terms.shape[1]
        for run in _runs(np.flatnonzero(weights)):
            own = weights[run]
            out[:r, :r] += (own @ self.terms[run].reshape(-1, r * r)).reshape(r, r)
            if self.further is not None:
                _, rows, k = self.further.shape
                border(out, (own @ self.further[run].reshape(-1, rows * k)).reshape(rows, k))


def border(out: Real, columns: Real) -> None:
    """The last columns (r, k) of a symmetric matrix, and its last rows, added in place."""
    r, k = columns.shape
    out[:, r - k :] += columns
    out[r - k :, : r - k] += columns[: r - k].T


def _runs(places: np.ndarray) -> Iterator[slice]:
    """Stretches that hold all ``places``, ascending, and not much else."""
    if not len(places):
        return
    for run in np.split(places, np.flatnonzero(np.diff(places) > APART) + 1):
        yield slice(int(run[0]), int(run[-1]) + 1)


def summed(values: Real, local: Real, last: int = 0) -> Real:
    """Σ Vᵀ T V over elements: values (e, d, d), local (e, d, r); of the ``last`` columns only where
    that is not 0."""
    e, d, r = local.shape
    right = local[:, :, r - last :] if last else local
    if not np.any(values):
        return np.zeros((r, right.shape[2]))
    moved = np.matmul(values, right).reshape(e * d, -1)
    return np.asarray(local.reshape(e * d, r).T @ moved)
