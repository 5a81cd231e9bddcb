"""A change of the dynamic stiffness along a few directions, at any size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.block import Index
from cvxupdate.physics.context import Real

Complex = NDArray[np.complex128]
FAINT = 1e-9  # of the largest: what is smaller is none


@dataclass(frozen=True)
class LowRank:
    """Δ Z = W A Wᵀ with A = (Λ⁻¹ / (p f(s)) + B)⁻¹ at size p: DOFs ``used`` (u,), ``W`` (u, r), Λ's
    diagonal ``weights`` (r,), ``f`` of the points, B's diagonal ``behind`` (r,): the flexibility,
    taken with the sign of Λ, of what stands in series with the effect (zeros: nothing does)."""

    used: Index
    W: Real
    weights: Real
    f: Callable[[Complex], Complex]
    behind: Real

    def at(self, sizes: Real, s: Complex) -> Complex:
        """A's diagonal (points, sizes, r)."""
        plain = self.f(s)[:, None, None] * np.multiply.outer(sizes, self.weights)
        return np.asarray(plain / (1.0 + plain * self.behind))


def parallel(used: Index, W: Real, weights: Real) -> LowRank:
    """Stiffness beside what is there, at every frequency the same."""
    return LowRank(used, W, weights, np.ones_like, np.zeros(len(weights)))


def opened(
    used: Index,
    across: Real,
    within: Real,
    unit: float,
    f: Callable[[Complex], Complex],
    most: int | None = None,
) -> LowRank:
    """DOFs that the model joins or holds rigidly, each set free on a spring of compliance ``unit``
    p f(s), massless or with the mass that is in f: ``across`` (u, r) is the stiffness between the
    DOFs ``used`` and those set free, ``within`` (r, r) that of the latter themselves.

    Their motion condensed, K changes by −k (I / (unit p f) + K_ff)⁻¹ kᵀ: directions are the
    eigenvectors of K_ff, in which the springs stay alike; the ``most`` softest, where that is
    given: those are smooth, and what others do no mode of the band feels.
    """
    stiff, turn = np.linalg.eigh(0.5 * (within + within.T))
    kept = stiff > FAINT * np.max(np.abs(stiff), initial=0.0)
    kept[len(kept) if most is None else most :] = False  # in ascending order
    W = across @ turn[:, kept]
    return LowRank(used, W, np.full(W.shape[1], -unit), f, -stiff[kept])
