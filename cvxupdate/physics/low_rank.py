"""Effects that act along a few directions: their change of the dynamic stiffness at any size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import DerivativeBlock
from cvxupdate.physics.context import Real
from cvxupdate.physics.effect import Effect, HiddenOscillator, ModelChange

Complex = NDArray[np.complex128]
DIRECTIONS = 3  # columns of W at most
FAINT = 1e-9  # of the largest eigenvalue: what is smaller is none


@dataclass(frozen=True)
class LowRank:
    """Δ Z = γ f(s) W Λ Wᵀ: DOFs ``used`` (u,), ``W`` (u, r), Λ's diagonal ``weights`` (r,), ``f``
    of the points, for amounts γ (`amounts`)."""

    used: Index
    W: Real
    weights: Real
    f: Callable[[Complex], Complex]


def low_rank(effect: Effect) -> LowRank | None:
    """An effect as a change along few directions; None where it is none."""
    match effect.action:
        case HiddenOscillator() as hidden:
            return _dynamic_mass(hidden)
        case ModelChange() as change if change.count == 1 and len(change.tangent[0]) == 1:
            return _eigen(change.tangent[0][0]) if change.additive or not change.members else None
    return None


def amounts(effect: Effect, sizes: Real) -> Real:
    """γ of `LowRank` at ``sizes`` of the effect's first unknown."""
    change = effect.change
    return sizes / (1.0 + sizes) if change is not None and change.series else sizes


def _dynamic_mass(hidden: HiddenOscillator) -> LowRank:
    """s² (2ζωs + ω²) / (s² + 2ζωs + ω²) per kg at its DOF."""
    omega = 2.0 * np.pi * hidden.frequency

    def f(s: Complex) -> Complex:
        soft = 2.0 * hidden.zeta * omega * s + omega**2
        return np.asarray(s**2 * soft / (s**2 + soft))

    return LowRank(np.array([hidden.row]), np.ones((1, 1)), np.ones(1), f)


def _eigen(block: DerivativeBlock) -> LowRank | None:
    """One element that moves one matrix, by the eigenvectors of what it does to that."""
    found = [(part, f) for part, f in _parts(block) if part is not None]
    if len(found) != 1 or len(block.dofs) != 1:
        return None
    part, f = found[0]
    free = block.dofs[0] >= 0
    used, inverse = np.unique(block.dofs[0][free], return_inverse=True)
    whole = np.zeros((len(used), len(used)))
    np.add.at(whole, (inverse[:, None], inverse[None, :]), part[0][np.ix_(free, free)])
    values, vectors = np.linalg.eigh(0.5 * (whole + whole.T))
    kept = np.abs(values) > FAINT * np.max(np.abs(values), initial=0.0)
    if not 0 < kept.sum() <= DIRECTIONS:
        return None
    return LowRank(used, vectors[:, kept], values[kept], f)


def _parts(b: DerivativeBlock) -> tuple[tuple[Real | None, Callable[[Complex], Complex]], ...]:
    return (
        (b.K, np.ones_like),
        (b.M, np.square),
        (b.C, lambda s: s),
        (b.D, lambda s: np.full_like(s, 1j)),
    )
