"""Fixtures on tables of modes: what supports with a stiffness and a mass of their own explain.

One brings modes that the model does not have and moves its neighbours apart, as a hidden oscillator
does. In the space of the model's own modes the supports' motions are further coordinates, each with
the shape that the structure takes when it is moved slowly (Craig and Bampton 1968): as many
eigenproblems as there are tunings and compliances are solved in one call. Its unknowns count as
those of several effects do: few figures are fitted by nearly any four (`settings.SPARE`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from cvxupdate.diagnose.hypothesis import FIXTURE as FIXTURES
from cvxupdate.diagnose.modes.scene import Scene
from cvxupdate.diagnose.modes.tuned import FEWEST, MARGIN
from cvxupdate.diagnose.screen.shortlist import best_of
from cvxupdate.diagnose.types import Key, Real, Score
from cvxupdate.fe.model import Model
from cvxupdate.fe.stacked import eigh
from cvxupdate.physics.effect import Effect

FIXTURE = "fixture"  # the kind of its elements
SIZES = np.geomspace(3e-3, 3e2, 11)  # compliances, in the structure's at the place
SHIFT = 1e-3  # of the lowest eigenvalue: what is held in part only can be moved slowly, too


@dataclass(frozen=True)
class Feet:
    """Of the supports that a grown model has set free: compliance and mass (r,) without the
    effect's own unknowns, and what a unit of each of these adds, (count, r)."""

    a: Real
    m: Real
    slopes: tuple[Real, Real]

    @classmethod
    def of(cls, grown: Model, base: int, p: Real, count: int) -> Feet:
        """``base``: DOFs before; ``p`` of all parameters but the last ``count``."""
        start = np.append(p, np.zeros(count))
        units = np.eye(len(start))[len(p) :]
        a, m = _properties(grown, base, start)
        moved = [_properties(grown, base, start + unit) for unit in units]
        return cls(a, m, (np.array([x - a for x, _ in moved]), np.array([y - m for _, y in moved])))

    def at(self, sizes: Real) -> tuple[Real, Real]:
        """Stiffness and mass (n, r) at ``sizes`` (n, count) of the unknowns."""
        return 1.0 / (self.a + sizes @ self.slopes[0]), self.m + sizes @ self.slopes[1]


def _properties(grown: Model, base: int, p: Real) -> tuple[Real, Real]:
    a, m = np.zeros((2, grown.size - base))
    for block, own in zip(grown.blocks, grown.properties(p), strict=True):
        rows = block.dofs[:, 0] - base
        if block.kind.name == FIXTURE and np.all(rows >= 0):
            a[rows], m[rows] = own["a0"] + own["a"], own["m"]
    return a, m


@dataclass(frozen=True)
class Stood:
    """A structure in the basis of its modes, held, and of its supports' motions: ``K``, ``M``
    (q + r, q + r) with these free; ``tails`` the shapes of the motions (DOFs, r) at the sensors of
    each measured shape; ``q`` modes."""

    K: Real
    M: Real
    tails: tuple[Real, ...]
    q: int

    @classmethod
    def of(cls, where: Scene, grown: Model, p: Real, count: int) -> Stood:
        """Of a model on fixtures, at parameters ``p`` and none of its last ``count``."""
        base = len(where.many.shapes)
        enough = max(where.many.rigid + FEWEST, int(where.used.max(initial=0)) + MARGIN)
        phi = where.many.shapes[:, :enough]
        at = grown.matrices(np.append(p, np.zeros(count)))
        shift = SHIFT * float(where.many.eigenvalues[where.many.rigid])
        slow = (at.K + shift * at.M).tocsc()[:base]
        psi = -splu(slow[:, :base].tocsc()).solve(slow[:, base:].toarray())
        r, q = psi.shape[1], phi.shape[1]
        T = np.block([[phi, psi], [np.zeros((r, q)), np.eye(r)]])
        k, m = Feet.of(grown, base, p, count).at(np.zeros((1, count)))
        free = [
            X - np.diag(np.append(np.zeros(q), x[0]))
            for X, x in ((T.T @ (at.K @ T), k), (T.T @ (at.M @ T), m))
        ]
        return cls(free[0], free[1], tuple(psi[rows] for _, rows, _, _ in where.shapes), q)

    def left(self, where: Scene, k: Real, m: Real) -> Real:
        """Squared residuals (n,) that n fixtures of stiffnesses ``k`` and masses ``m`` (n, r)
        leave."""
        n, ends = len(k), np.arange(self.q, len(self.K))
        K, M = (np.repeat(X[None], n, axis=0) for X in (self.K, self.M))
        K[:, ends, ends] += k
        M[:, ends, ends] += m
        L = np.linalg.inv(np.linalg.cholesky(M))
        lam, V = eigh(L @ K @ np.swapaxes(L, 1, 2))
        V = np.swapaxes(L, 1, 2) @ V
        tails = [np.broadcast_to(t, (n, *t.shape)) for t in self.tails]
        at = where.nearest(np.broadcast_to(where.used, (n, len(where.used))), lam, V, tails)
        own = np.take_along_axis(V, at[:, None, :], axis=2)
        return where.left(np.take_along_axis(lam, at, axis=1), where.mixed(own, tails))


def on_fixtures(where: Scene, candidates: Sequence[Effect], p: Real) -> list[Score]:
    """Of each place the best of its fixtures, at its best size; ``p`` are the parameters of the
    model that they stand on."""
    out: list[Score] = []
    stood: dict[Key, Stood] = {}
    for e in candidates:
        change, sizes = e.change, _sizes(e)
        if change is None or not len(sizes) or where.total <= 0.0:
            continue
        grown = change.model
        if e.key not in stood:
            stood[e.key] = Stood.of(where, grown, p, e.count)
        k, m = Feet.of(grown, len(where.many.shapes), p, e.count).at(sizes)
        left = stood[e.key].left(where, k, m)
        best = int(np.argmin(left))
        fraction = max(0.0, 1.0 - float(left[best]) / where.total)
        out.append(Score(e, fraction, sizes[best], exact=True))
    return best_of(out)


def _sizes(effect: Effect) -> Real:
    """Those that are tried, (n, count); none of what is no fixture."""
    change = effect.change
    if change is None or change.start is None or effect.physics != FIXTURES:
        return np.zeros((0, effect.count))
    starts = [change.start(size) for size in SIZES.tolist()]
    others = [other for s in starts for other in (change.others(s) if change.others else ())]
    return np.array([*starts, *others])
