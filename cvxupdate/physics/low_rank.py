"""Effects that act along a few directions: their change of the dynamic stiffness at any size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import DerivativeBlock
from cvxupdate.physics.context import Real
from cvxupdate.physics.directions import FAINT, Complex
from cvxupdate.physics.directions import LowRank as LowRank
from cvxupdate.physics.effect import Effect, HiddenOscillator, ModelChange

DIRECTIONS = 3  # columns of W at most, of one place
MOST = 40  # of a class of equal places: twelve joints that turn about three axes


def low_rank(effect: Effect) -> LowRank | None:
    """An effect as a change along few directions; None where it is none."""
    match effect.action:
        case HiddenOscillator() as hidden:
            return _dynamic_mass(hidden)
        case ModelChange(along=LowRank() as along):
            return along if along.W.shape[1] <= MOST else None
        case ModelChange() as change if change.count == 1 and len(change.tangent[0]) == 1:
            if change.additive or not change.members:
                return _eigen(change.tangent[0][0], change.series)
    return None


def directions(effect: Effect) -> tuple[Index, Real] | None:
    """Where and along what an effect acts: DOFs (u,) and (u, r); what a whole member is stiff
    against, whatever goes with it in mass. None where these are many."""
    change = low_rank(effect)
    if change is not None:
        return change.used, change.W
    if effect.change is None or not effect.type.total:
        return None
    tangent = effect.change.tangent[0]
    used, values, vectors = _modes_of([(b.dofs, b.K) for b in tangent if b.K is not None])
    return (used, vectors) if 0 < len(values) <= MOST else None


def _dynamic_mass(hidden: HiddenOscillator) -> LowRank:
    """s² (2ζωs + ω²) / (s² + 2ζωs + ω²) per kg at its DOF."""
    omega = 2.0 * np.pi * hidden.frequency

    def f(s: Complex) -> Complex:
        soft = 2.0 * hidden.zeta * omega * s + omega**2
        return np.asarray(s**2 * soft / (s**2 + soft))

    return LowRank(np.array([hidden.row]), np.ones((1, 1)), np.ones(1), f, np.zeros(1))


def _eigen(block: DerivativeBlock, series: bool) -> LowRank | None:
    """One element that moves one matrix, by the eigenvectors of what it does to that."""
    found = [(part, f) for part, f in _parts(block) if part is not None]
    if len(found) != 1 or len(block.dofs) != 1:
        return None
    part, f = found[0]
    used, values, vectors = _modes_of([(block.dofs, part)])
    if not 0 < len(values) <= DIRECTIONS:
        return None
    behind = 1.0 / values if series else np.zeros(len(values))
    return LowRank(used, vectors, values, f, behind)


def _modes_of(parts: Sequence[tuple[Index, Real]]) -> tuple[Index, Real, Real]:
    """The DOFs (u,) on which elements (dofs (e, d), matrices (e, d, d)) act together, and the
    eigenvalues (r,) and eigenvectors (u, r) of that which are none by rounding."""
    used = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(d[d >= 0] for d, _ in parts)]))
    whole = np.zeros((len(used), len(used)))
    for dofs, K in (pair for d, k in parts for pair in zip(d, k, strict=True)):
        own = np.flatnonzero(dofs >= 0)
        rows = np.searchsorted(used, dofs[own])
        np.add.at(whole, (rows[:, None], rows[None, :]), K[np.ix_(own, own)])
    values, vectors = np.linalg.eigh(0.5 * (whole + whole.T))
    kept = np.abs(values) > FAINT * np.max(np.abs(values), initial=0.0)
    return used, values[kept], vectors[:, kept]


def _parts(b: DerivativeBlock) -> tuple[tuple[Real | None, Callable[[Complex], Complex]], ...]:
    return (
        (b.K, np.ones_like),
        (b.M, np.square),
        (b.C, lambda s: s),
        (b.D, lambda s: np.full_like(s, 1j)),
    )
