"""Effects on tables of modes at finite sizes: what one explains at its best size, however large.

A support moves a mode by as much as it likes but its first derivative does not know that: to first
order a roller shifts every frequency in proportion to the deflection there, while a stiff one turns
the deflection into a node. So effects that act on few DOFs are taken at finite sizes, in the
space of the model's own modes (Ritz; Fox and Kapoor 1968 is the limit of a small size), and only
the nuisance parameters are linearised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.modes.attachment import attachments
from cvxupdate.diagnose.modes.scene import Scene, assigned
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.stacked import eigh
from cvxupdate.physics.effect import Effect, ModelChange
from cvxupdate.physics.low_rank import low_rank
from cvxupdate.residual.eigen import padded

BASIS = 48  # modes that span what a local change can do to the lowest ones
SIZES = 16  # tried on each side, in geometric progression


@dataclass(frozen=True)
class Effort:
    """``sizes`` tried on each side, ``finer`` ones between the neighbours of the best, in a basis
    of ``modes``."""

    sizes: int
    finer: int
    modes: int


FULL, QUICK = Effort(SIZES, 5, BASIS), Effort(6, 0, 20)
MANY, CLOSER = (
    150,
    24,
    # local candidates above which a quick pass chooses those that are looked at closely: so many of
    # an effect type and a kind of DOF
)
# candidates whose sizes are tried at a time: one call finds the modes of all, and their matrices
# stay small
TOGETHER = 64


@dataclass(frozen=True)
class Change:
    """What one unit of several effects does to stiffness and mass in the basis: ``K`` (n, q, q),
    ``M`` (n, q, q) or None where mass stays; ``inverse`` (n,): a compliance in series with the
    stiffness of its surroundings, p / (1 + p) units of it. ``values`` (n, q) are the basis's
    eigenvalues, ``tails`` (n, DOFs, r) what its own attachment modes have at the sensors of each
    measured shape. ``W`` (n, q, r), ``weights``, ``behind`` (n, r): directions that give way each
    by itself (`LowRank`), beside K."""

    K: Real
    M: Real | None
    inverse: NDArray[np.bool_]
    values: Real
    tails: tuple[Real, ...]
    W: Real
    weights: Real
    behind: Real

    def of(self, which: Index) -> Change:
        """Of some of them, or of one several times."""
        return Change(
            self.K[which],
            None if self.M is None else self.M[which],
            self.inverse[which],
            self.values[which],
            tuple(tail[which] for tail in self.tails),
            self.W[which],
            self.weights[which],
            self.behind[which],
        )

    def stiffness(self, p: Real) -> Real:
        """What sizes ``p`` (n,) add to the stiffness (n, q, q); a compliance is never negative."""
        out = np.where(self.inverse, p / (1.0 + np.abs(p)), p)[:, None, None] * self.K
        if self.W.shape[2]:
            plain = p[:, None] * self.weights
            own = self.W * (plain / (1.0 + plain * self.behind))[:, None, :]
            out += own @ np.swapaxes(self.W, 1, 2)
        return np.asarray(out)


@dataclass(frozen=True)
class Trace:
    """n effects followed through s sizes each: the squared residual ``left`` (n, s), infinite where
    there is no structure; modes ``V`` (n, s, q, q) in the basis and where the paired ones went,
    ``at`` (n, s, used)."""

    left: Real
    V: Real
    at: Index


def local(e: Effect) -> ModelChange | None:
    """What an effect of one parameter on a few DOFs, which may be large, does to the model."""
    change = e.change if e.count == 1 else None
    return change if e.place.nodes or e.type.total else None


def scan(where: Scene, candidates: Sequence[Effect]) -> dict[int, tuple[float, float]]:
    """For each local candidate (by its number): (squared residual left, best size)."""
    which = [k for k, e in enumerate(candidates) if local(e) is not None]
    out: dict[int, tuple[float, float]] = {}
    if len(which) > MANY:
        out = dict(
            zip(which, best_sizes(where, [candidates[k] for k in which], QUICK), strict=True)
        )
        count: dict[tuple[str, str | None], int] = {}
        which = []
        for k in sorted(out, key=lambda k: out[k][0]):
            kind = (candidates[k].physics, candidates[k].place.dof)
            count[kind] = count.get(kind, 0) + 1
            which += [k] if count[kind] <= CLOSER else []
    return out | dict(
        zip(which, best_sizes(where, [candidates[k] for k in which], FULL), strict=True)
    )


def best_sizes(
    where: Scene, candidates: Sequence[Effect], effort: Effort
) -> list[tuple[float, float]]:
    """(squared residual that is left, size) of each of some local effects at the best of its
    sizes."""
    out = [(np.inf, 0.0)] * len(candidates)
    for heavy, wide in ((False, False), (True, False), (False, True)):
        alike = [
            k
            for k, e in enumerate(candidates)
            if (change := local(e))
            and any(b.M is not None for b in change.tangent[0]) == heavy
            and (change.along is not None) == wide
        ]
        for first in range(0, len(alike), TOGETHER):
            some = alike[first : first + TOGETHER]
            for k, found in zip(
                some, _best(where, [candidates[k] for k in some], effort), strict=True
            ):
                out[k] = found
    return out


def traced(where: Scene, candidates: Sequence[Effect], sizes: Real, modes: int) -> Real:
    """(n, s) squared residuals that n local effects, all of which change the mass or none, leave at
    ``sizes`` (n, s) that grow from zero, in a basis of so many ``modes``."""
    enough = max(where.many.rigid + modes, int(where.used.max(initial=0)) + 7)
    changes = _change(where, min(enough, where.many.shapes.shape[1]), candidates)
    n, q = changes.K.shape[:2]
    V = np.broadcast_to(np.eye(q), (n, q, q))
    return _trace(where, changes, sizes, V, np.broadcast_to(where.used, (n, len(where.used)))).left


def _best(where: Scene, candidates: Sequence[Effect], effort: Effort) -> list[tuple[float, float]]:
    """`best_sizes` of effects that all change the mass or all leave it."""
    enough = max(
        where.many.rigid + effort.modes, int(where.used.max(initial=0)) + 7
    )  # margin for modes that cross
    enough = min(enough, where.many.shapes.shape[1])
    changes = _change(where, enough, candidates)
    runs = [(k, side) for k, e in enumerate(candidates) for side in _sides(e, effort.sizes)]
    best = [(np.inf, 0.0)] * len(candidates)
    if not runs:
        return best
    owner, sizes = np.array([k for k, _ in runs]), np.array([side for _, side in runs])
    q = changes.K.shape[1]
    V, at = (
        np.broadcast_to(np.eye(q), (len(runs), q, q)),
        np.broadcast_to(where.used, (len(runs), len(where.used))),
    )
    coarse = _trace(where, changes.of(owner), sizes, V, at)
    k, row = np.argmin(coarse.left, axis=1), np.arange(len(runs))
    last = (
        np.isfinite(coarse.left).sum(axis=1) - 1
    )  # a trace ends where there is no structure any more
    low = np.where(k > 0, sizes[row, np.maximum(k - 1, 0)], 0.3 * sizes[:, 0])
    high = sizes[row, np.clip(k + 1, 0, np.maximum(last, 0))]
    finer = (
        np.sign(low)[:, None]
        * np.geomspace(np.abs(low), np.abs(high), effort.finer + 2, axis=1)[:, 1:-1]
    )
    before = np.maximum(k - 1, 0)
    V, at = (
        np.where((k > 0)[:, None, None], coarse.V[row, before], V),
        np.where((k > 0)[:, None], coarse.at[row, before], at),
    )
    fine = _trace(where, changes.of(owner), finer, V, at)
    for r, o in enumerate(owner.tolist()):
        if last[r] >= 0:
            best[o] = min(
                best[o],
                (float(coarse.left[r, k[r]]), float(sizes[r, k[r]])),
                *zip(fine.left[r].tolist(), finer[r].tolist(), strict=True),
            )
    return best


def _change(where: Scene, count: int, candidates: Sequence[Effect]) -> Change:
    """Local effects in a basis of ``count`` modes and of their own attachment modes."""
    own, kappa = attachments(where.matrices, where.many, count, candidates)
    modes, n = where.many.shapes[:, :count], len(candidates)
    q = count + own.shape[2]
    parts = {"K": np.zeros((n, q, q)), "M": np.zeros((n, q, q))}
    changes = [change for e in candidates if (change := local(e)) is not None]
    alongs = [low_rank(e) if e.change and e.change.along else None for e in candidates]
    r = max((a.W.shape[1] for a in alongs if a is not None), default=0)
    W, weights, behind = np.zeros((n, q, r)), np.zeros((n, r)), np.zeros((n, r))
    for k, (change, along) in enumerate(zip(changes, alongs, strict=True)):
        phi = padded(np.hstack([modes, own[k]]))
        if along is not None:
            width = along.W.shape[1]
            W[k, :, :width] = phi[along.used].T @ along.W
            weights[k, :width], behind[k, :width] = along.weights, along.behind
        for b in change.tangent[0] if along is None else ():
            for name, part in (("K", b.K), ("M", b.M)):
                if part is not None:
                    at = phi[b.dofs]
                    parts[name][k] += at.reshape(-1, q).T @ (part @ at).reshape(-1, q)
    lowest = np.broadcast_to(where.many.eigenvalues[:count], (n, count))
    return Change(
        parts["K"],
        parts["M"] if np.any(parts["M"]) else None,
        np.array([change.series for change in changes]),
        np.hstack([lowest, kappa]),
        tuple(own[:, rows] for _, rows, _, _ in where.shapes),
        W,
        weights,
        behind,
    )


def _sides(c: Effect, count: int) -> list[Real]:
    """Sizes from small to large, on each side that the effect may take."""
    lower, upper = c.limits
    sides = [np.geomspace(1e-3, upper, count)] if upper > 1e-3 else []
    if lower < -1e-3 and c.sign <= 0:
        sides.append(-np.geomspace(1e-3, -lower, count))
    return sides


def _trace(where: Scene, changes: Change, sizes: Real, V: Real, at: Index) -> Trace:
    """Modes followed through ``sizes`` (n, s) from where they were, ``V`` (n, q, q) and ``at`` (n,
    used); ends where more mass is taken off than there is.

    With M = W w Wᵀ the modes of I + p M come from T = W (1 + p w)^−½, so that one call finds those
    of all the effects.
    """
    n, q = V.shape[0], V.shape[1]
    there, alive = np.arange(n)[:, None], np.ones(n, dtype=bool)
    w, W = (np.zeros((n, q)), V) if changes.M is None else eigh(changes.M)
    out = Trace(
        np.full(sizes.shape, np.inf),
        np.empty((*sizes.shape, q, q)),
        np.empty((*sizes.shape, at.shape[1]), dtype=np.int64),
    )
    for s, p in enumerate(sizes.T):
        stiff = changes.stiffness(p)
        stiff[:, np.arange(q), np.arange(q)] += changes.values
        before = np.take_along_axis(V, at[:, None, :], axis=2).transpose(0, 2, 1)
        if changes.M is None:
            lam, V = eigh(stiff)
        else:
            mass = 1.0 + p[:, None] * w
            alive = alive & np.all(mass > 0.0, axis=1)
            T = W / np.sqrt(np.where(mass > 0.0, mass, 1.0))[:, None, :]
            lam, V = eigh(T.transpose(0, 2, 1) @ stiff @ T)
            V = T @ V
            before = before + p[:, None, None] * (before @ changes.M)
        at = assigned((before @ V) ** 2)
        # modes that veer or mix may be other ones to the table than those that were followed
        ways = [at, where.nearest(at, lam, V, changes.tails)]
        left = np.min([_left(where, changes, lam[there, way], V, way) for way in ways], axis=0)
        if not where.shapes:
            left = np.minimum(left, where.left(lam[:, where.used], ()))
        out.left[:, s], out.V[:, s], out.at[:, s] = (
            np.where(alive & np.isfinite(left), left, np.inf),
            V,
            at,
        )
    return out


def _left(where: Scene, changes: Change, eigenvalues: Real, V: Real, at: Index) -> Real:
    """`Scene.left` of the modes ``at`` (n, used) of ``V``."""
    own = np.take_along_axis(V, at[:, None, :], axis=2)
    return where.left(eigenvalues, where.mixed(own, changes.tails))
