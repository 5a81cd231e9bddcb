"""Sets of elements at finite sizes, in the basis of the lowest modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.responses.few import Measure
from cvxupdate.diagnose.responses.finite_size import SIZES
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.screen.sizes import best_size
from cvxupdate.diagnose.types import Score
from cvxupdate.fe.synthesis.derivatives import modal_blocks
from cvxupdate.fe.synthesis.pieces import Response
from cvxupdate.fe.synthesis.products import times
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.low_rank import low_rank

FINEST = 24  # sets whose sizes are refined
SETS = 300  # sets of elements looked at: those with the largest first-order fractions


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


def sets_of_elements(point: ResponsePoint, scores: Sequence[Score], left: Measure) -> list[Score]:
    """The scores of factors with one parameter that act along many directions, sets of elements
    first of all, each at the best of several sizes: those with the largest first-order
    fractions."""
    total = left.total
    if total <= 0.0 or any(r.coupled for r in point.responses):
        return []
    weights = [1.0 / s.scale() for s in point.setting.signals]
    few = min(point.low, *(len(r.q) for r in point.responses))
    shapes = point.modes.shapes[:, :few]
    today = [Today.of(r, few) for r in point.responses]
    able = [s for s in scores if _is_factor(s.effect)]

    def tried(reduced: Reduced, score: Score, sizes: Real, rounds: int) -> Score | None:
        def squares(p: Real) -> Real:
            change = reduced.effect.change
            stiff = p if change is None else change.stiffness_of(p)
            return left.remaining(
                _weighted(point, weights, _changed(point, today, reduced, stiff, p))
            )

        best = best_size(squares, sizes, total, rounds)
        if best is None:
            return None
        return replace(score, fraction=1.0 - best[1] / total, p=np.array([best[0]]), exact=True)

    found: list[tuple[Score, Real, Reduced]] = []
    for score in sorted(able, key=lambda s: -s.fraction)[:SETS]:
        low, high = score.effect.limits
        sizes = np.array([x for x in SIZES if low < x < high])
        reduced = Reduced.of(score.effect, shapes)
        first = tried(reduced, score, sizes, 0)
        if first is not None:
            found.append((first, sizes, reduced))
    best = sorted(found, key=lambda item: -item[0].fraction)
    finer = [tried(reduced, score, sizes, 2) for score, sizes, reduced in best[:FINEST]]
    return [*(s for s in finer if s is not None), *(score for score, _, _ in best[FINEST:])]


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
    K = np.diag(lam) + stiff[:, None, None] * reduced.K
    M = np.eye(low) + heavy[:, None, None] * reduced.M
    massive = np.linalg.eigvalsh(M)[:, 0] > 0.0
    M[~massive], K[~massive] = np.eye(low), np.diag(lam)
    half = np.linalg.inv(np.linalg.cholesky(M))
    other = np.swapaxes(half, 1, 2)
    new, X = np.linalg.eigh(half @ K @ other)
    V, new = np.swapaxes(other @ X, 1, 2), np.maximum(new, 0.0)  # (sizes, modes, modes before)
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
