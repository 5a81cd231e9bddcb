"""Sets of elements at finite sizes, in the basis of the lowest modes.

Of a set that changes much a derivative says little: where a model is far off, the one that explains
nearly all may stand behind hundreds to first order. So all are tried at several sizes, on as few
lines as smooth recordings need, and the best of them on every line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.responses.few import Measure
from cvxupdate.diagnose.responses.finite_size import EXACT, SIZES, on_few_lines
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.screen.sizes import best_size
from cvxupdate.diagnose.types import Score
from cvxupdate.fe.stacked import eigh
from cvxupdate.fe.synthesis.derivatives import modal_blocks
from cvxupdate.fe.synthesis.pieces import Response
from cvxupdate.fe.synthesis.products import times
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.low_rank import low_rank

FINEST = 24  # sets whose sizes are refined
SETS = 1500  # sets of elements looked at: those with the largest first-order fractions


@dataclass(frozen=True)
class Reduced:
    """An effect's change of K and M per unit in the basis of the lowest modes, (low, low) each."""

    effect: Effect
    K: Real
    M: Real

    @classmethod
    def of(cls, effect: Effect, shapes: Real) -> Reduced:
        """From its derivative blocks; ``shapes`` (N, low)."""
        low = shapes.shape[1]
        rates = [np.zeros((low, low)), np.zeros((low, low))]
        for block in effect.change.tangent[0] if effect.change is not None else ():
            for k, part in enumerate(modal_blocks(shapes, block)[:2]):
                rates[k] += 0.0 if part is None else part
        return cls(effect, rates[0], rates[1])


@dataclass(frozen=True)
class Today:
    """A response as it is, from its lowest modes: modal ``force`` (modes, points, cases), shapes
    ``at`` (modes, sensors), displacement ``y`` (sensors, points, cases)."""

    force: Complex
    at: Real
    y: Complex

    @classmethod
    def of(cls, r: Response, low: int) -> Today:
        """Of so many modes."""
        y = times(r.at[:low].T, r.q[:low])
        return cls(r.q[:low] / r.inverse[:low, :, None], r.at[:low], y)


@dataclass(frozen=True)
class Trial:
    """A ``point`` with the ``weights`` of its rows and its responses ``today``, and what is
    ``left`` beside a change of it."""

    point: ResponsePoint
    weights: tuple[Real, ...]
    today: tuple[Today, ...]
    left: Measure

    @classmethod
    def of(cls, point: ResponsePoint, low: int, left: Measure) -> Trial:
        """With so many modes."""
        weights = tuple(1.0 / s.scale() for s in point.setting.signals)
        return cls(point, weights, tuple(Today.of(r, low) for r in point.responses), left)

    def sized(self, score: Score, reduced: Reduced, rounds: int) -> Score | None:
        """At the best of several sizes, and of finer ones in so many ``rounds``; None where none
        helps."""
        change, (low, high) = score.effect.change, score.effect.limits
        sizes = np.array([x for x in SIZES if low < x < high])

        def squares(p: Real) -> Real:
            stiff = p if change is None else change.stiffness_of(p)
            moved = _changed(self.point, self.today, reduced, stiff, p)
            return self.left.remaining(_weighted(self.point, self.weights, moved))

        total = self.left.total
        best = best_size(squares, sizes, total, rounds)
        if best is None:
            return None
        return replace(score, fraction=1.0 - best[1] / total, p=np.array([best[0]]), exact=True)


def sets_of_elements(point: ResponsePoint, scores: Sequence[Score], left: Measure) -> list[Score]:
    """The scores of factors with one parameter that act along many directions, sets of elements
    first of all, each at the best of several sizes."""
    if left.total <= 0.0 or any(r.coupled for r in point.responses):
        return []
    few = min(point.low, *(len(r.q) for r in point.responses))
    able = sorted((s for s in scores if _is_factor(s.effect)), key=lambda s: -s.fraction)[:SETS]
    reduced = _reduced([s.effect for s in able], point.modes.shapes[:, :few])
    chosen = list(zip(able, reduced, strict=True))
    rough = Trial.of(on_few_lines(point), few, left)
    exact = Trial.of(point, few, left)
    best = _ranked(exact, _ranked(rough, chosen)[:EXACT])
    finer = [exact.sized(s, r, 2) for s, r in best[:FINEST]]
    return [*(s for s in finer if s is not None), *(s for s, _ in best[FINEST:])]


def _ranked(trial: Trial, sets: Sequence[tuple[Score, Reduced]]) -> list[tuple[Score, Reduced]]:
    """Those that help at some size, the best first."""
    found = ((trial.sized(s, r, 0), r) for s, r in sets)
    able = [(s, r) for s, r in found if s is not None]
    return sorted(able, key=lambda pair: -pair[0].fraction)


def _reduced(effects: Sequence[Effect], shapes: Real) -> list[Reduced]:
    """Of each effect; of sets of elements as the sums of those of single ones."""
    alone: dict[tuple[str, int], Reduced] = {}
    for e in effects:
        if e.change is not None and e.change.additive and len(e.change.members) == 1:
            alone[e.physics, e.change.members[0]] = Reduced.of(e, shapes)
    out = []
    for e in effects:
        members = e.change.members if e.change is not None and e.change.additive else ()
        parts = [alone.get((e.physics, i)) for i in members]
        known = [p for p in parts if p is not None]
        if known and len(known) == len(parts):
            K, M = (np.sum([getattr(p, x) for p in known], axis=0) for x in "KM")
            out.append(Reduced(e, K, M))
        else:
            out.append(Reduced.of(e, shapes))
    return out


def _is_factor(effect: Effect) -> bool:
    """One factor on a property, along more directions than the closed form takes."""
    change = effect.change
    one = change is not None and change.count == 1 and effect.figures[0].nothing == 1.0
    return one and low_rank(effect) is None


def _changed(
    point: ResponsePoint, today: Sequence[Today], reduced: Reduced, stiff: Real, heavy: Real
) -> list[Complex]:
    """The responses' change (points, sensors, cases, sizes) when K and M in the basis of the lowest
    modes change by each of ``stiff``, ``heavy`` (sizes,) times the rates; modes keep their damping
    in their order. None where mass is no longer positive."""
    low = len(reduced.K)
    lam = np.maximum(point.modes.eigenvalues[:low], 0.0)
    new, V, massive = _modes(lam, reduced, stiff, heavy)
    loss = point.loss.first(low)
    slow, held = loss.viscous(new), loss.stiffness(new)
    out = []
    for r, now in zip(point.responses, today, strict=True):
        s = r.signal.s
        force = times(V.reshape(-1, low), now.force).reshape(*V.shape[:2], len(s), -1)
        force /= (s**2 + slow[:, :, None] * s + held[:, :, None])[..., None]
        read = np.swapaxes(V @ now.at, 1, 2)  # (sizes, sensors, modes)
        flat = np.ascontiguousarray(force.reshape(*V.shape[:2], -1)).view(float)
        moved = np.matmul(read, flat).view(complex).reshape(len(V), -1, *force.shape[2:])
        change = np.moveaxis(moved - now.y, (0, 2), (3, 0))
        change[..., ~massive] = 0.0
        out.append(r.drive[:, None, None, None] * change)
    return out


def _modes(
    lam: Real, reduced: Reduced, stiff: Real, heavy: Real
) -> tuple[Real, Real, NDArray[np.bool_]]:
    """Eigenvalues (sizes, modes), shapes (sizes, modes, modes before), and where mass is
    positive; elsewhere they are as before."""
    low = len(lam)
    K = np.diag(lam) + stiff[:, None, None] * reduced.K
    massive = np.ones(len(heavy), dtype=bool)
    if not np.any(reduced.M):
        new, X = eigh(K)
        return np.maximum(new, 0.0), np.swapaxes(X, 1, 2), massive
    M = np.eye(low) + heavy[:, None, None] * reduced.M
    try:
        root = np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        massive = np.linalg.eigvalsh(M)[:, 0] > 0.0
        M[~massive], K[~massive] = np.eye(low), np.diag(lam)
        root = np.linalg.cholesky(M)
    half = np.linalg.inv(root)
    other = np.swapaxes(half, 1, 2)
    new, X = eigh(half @ K @ other)
    return np.maximum(new, 0.0), np.swapaxes(other @ X, 1, 2), massive


def _weighted(point: ResponsePoint, weights: Sequence[Real], changes: Sequence[Complex]) -> Real:
    """Changes of the responses as weighted rows (rows, sizes)."""
    parts = []
    for r, w, change in zip(point.responses, weights, changes, strict=True):
        points, sensors, cases, count = change.shape
        flat = point.faulty(r.signal, change.reshape(points, sensors, cases * count))
        rows = r.rows(flat).reshape(-1, sensors, cases, count)
        weighted = (w[..., None] * rows).reshape(-1, count)
        parts += [weighted.real, weighted.imag]
    return np.vstack(parts)
