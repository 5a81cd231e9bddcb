"""Explained fractions at finite sizes, exactly: what acts along a few directions changes a
structure's receptances in closed form.

A first-order score says nothing of an effect that carries resonances past one another: a spring to
ground under a free structure has a derivative of rigid-body motion only. For a change W A Wᵀ of the
dynamic stiffness, A = (Λ⁻¹ / (p f(s)) + B)⁻¹, with few columns W, the responses change by
−l (Λ⁻¹ / (p f) + B + Wᵀ G W)⁻¹ r, where l, r are the receptances from W to the sensors and from the
drives to W (Sherman, Morrison and Woodbury; Ewins 2000, 6.4, coupling by FRFs). Springs, lumps,
dampers, joints, hidden oscillators, classes of equal supports and joints, resonating supports
and slender elements are of that kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cvxupdate.diagnose.responses.few import Few, Measure
from cvxupdate.diagnose.responses.oscillators import tuned
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real, thinned
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.screen.sizes import FINER, best_size, between
from cvxupdate.diagnose.types import Score, Seed
from cvxupdate.errors import ModelError
from cvxupdate.physics.low_rank import LowRank, low_rank

RESIZED = 60  # effects whose sizes are refined: more than any short list takes
FIXTURES = 16  # supports with a mass of their own: those of which a faint one explains most
SLIGHT = 1e-3  # size of a faint one: its compliance in units of its place
SIZES = (-0.45, -0.2, -0.08, 0.08, 0.2, 0.45, 1.0)  # of what acts on elements and whole members
LINES = 64  # of smooth recordings on which many effects are compared
EXACT, OF_EACH = 100, 12  # then tried on every line: the best of all, and of every type


def few_directions(
    point: ResponsePoint,
    scores: Sequence[Score],
    left: Measure,
    sift: Projection | None = None,
    thin: ResponsePoint | None = None,
) -> list[Score]:
    """The scores of effects that act along few directions, each at the best of several sizes
    within its bounds; fractions are exact but for nuisance parameters (``left``). An effect that no
    size helps has none, and of many only the best of all and of every type have one. ``sift``: of
    resonating supports only those that promise most by it; ``thin``: the point `on_few_lines`."""
    total = left.total
    if total <= 0.0:
        return []
    few, rough = Few.of(point), Few.of(on_few_lines(point) if thin is None else thin)

    def promise(change: LowRank, by: Projection) -> float:
        J = by.freed(few.rows(change, np.array([SLIGHT])))[:, 0]
        return float((J @ by.residual) ** 2 / max(float(J @ J), 1e-300))

    looked = scores if sift is None else _looked_at(scores, partial(promise, by=sift))
    found = []
    for score in tuned(few, rough, looked, left):
        change = low_rank(score.effect)
        if change is None:
            continue
        if score.effect.type.unlimited and point.modes.rigid:
            change = _with_loss(change, point)
        sizing = Sizing(few, left, change, few.sizes(score.effect, change))
        if len(sizing.sizes):
            found.append((score, sizing))
    best = [
        (score, sizing, at)
        for score, sizing in _foremost(found, rough)
        for at in [best_size(sizing.squares, sizing.sizes, total, rounds=0)]
        if at is not None
    ]
    best.sort(key=lambda item: item[2][1])
    return [
        _sized(score, *(sizing.finer(at) if k < RESIZED else at), total)
        for k, (score, sizing, at) in enumerate(best)
    ]


def on_few_lines(point: ResponsePoint) -> ResponsePoint:
    """A point with its model on as few lines as smooth recordings need (`thinned`)."""
    signals = point.setting.signals
    return replace(point, setting=point.setting.on([thinned(s, LINES) for s in signals]))


def _foremost(found: Sequence[tuple[Score, Sizing]], rough: Few) -> Sequence[tuple[Score, Sizing]]:
    """Of many effects those that leave least on few lines; all where they are few."""
    if len(found) <= EXACT:
        return found
    left = [float(np.min(s.on(rough).squares(s.sizes))) for _, s in found]
    seen: dict[str, int] = {}
    out = []
    for rank, k in enumerate(np.argsort(left, kind="stable").tolist()):
        name = found[k][0].effect.physics
        seen[name] = seen.get(name, 0) + 1
        if rank < EXACT or seen[name] <= OF_EACH:
            out.append(found[k])
    return out


@dataclass(frozen=True)
class Sizing:
    """A change at several ``sizes``, and what it leaves."""

    few: Few
    left: Measure
    change: LowRank
    sizes: Real

    def squares(self, sizes: Real) -> Real:
        """What is left at each size (n,)."""
        try:
            return self.left.remaining(self.few.rows(self.change, sizes))
        except np.linalg.LinAlgError:
            return np.full(len(sizes), np.inf)

    def on(self, few: Few) -> Sizing:
        """The same on other lines."""
        return replace(self, few=few)

    def finer(self, best: tuple[float, float]) -> tuple[float, float]:
        """The best of ``sizes`` and what it leaves, or one between its neighbours."""
        around = between(self.sizes, int(np.argmin(np.abs(self.sizes - best[0]))))
        return best_size(self.squares, around, best[1], rounds=FINER - 1) or best


def _sized(score: Score, size: float, left: float, total: float) -> Score:
    own = score.effect.change
    p = np.array([size, *np.zeros(score.effect.count - 1)])
    p = p if own is None or own.start is None else own.start(size)
    return replace(score, fraction=1.0 - left / total, p=p, exact=True)


def _with_loss(change: LowRank, point: ResponsePoint) -> LowRank:
    """Springs that hold a free structure, with the loss factor of a typical mode: rigid-body modes
    have no damping ratio, and on springs without loss they would stand out of all bounds where they
    are right."""
    zeta = float(np.median(point.damping[point.modes.rigid :])) if len(point.owner) else 0.0

    def lossy(s: Complex) -> Complex:
        return np.asarray(change.f(s) * (1.0 + 2j * zeta))

    return replace(change, f=lossy)


def _looked_at(scores: Sequence[Score], promise: Callable[[LowRank], float]) -> list[Score]:
    """All but the resonating supports far down by what a faint one explains."""
    swinging = [s for s in scores if s.effect.change is not None and s.effect.change.start]
    ranked = [
        (0.0 if lr is None else -promise(lr), s) for s in swinging for lr in [low_rank(s.effect)]
    ]
    dropped = {id(s) for _, s in sorted(ranked, key=lambda item: item[0])[FIXTURES:]}
    return [s for s in scores if id(s) not in dropped]


def whole_member(parent: ResponsePoint, seed: Seed, left: Measure) -> tuple[Seed, float]:
    """A seed with the best of several sizes of its last effect to begin with, and the fraction it
    then explains beside ``parent``.

    For what acts on whole members: too many directions for the closed form, so every size is a
    model of its own. Effects with several parameters stay as they are.
    """
    if seed.effects[-1].columns != 1:
        return seed, 0.0
    before, weights, _ = parent.differences
    at = len(seed.setting.model.parameters) - 1
    bound = seed.setting.model.parameters[at]

    def start(size: float) -> Real:
        p = seed.start.copy()
        p[at] = size
        return p

    def squares(sizes: Real) -> Real:
        out = np.full(len(sizes), np.inf)
        for k, size in enumerate(sizes):
            try:
                values = seed.setting.evaluate(start(float(size))).differences[0]
            except ModelError:
                continue
            out[k] = left.remaining((weights * (values - before))[:, None])[0]
        return out

    tried = {float(seed.start[at]), *(x for x in SIZES if bound.lower < x < bound.upper)}
    best = best_size(squares, np.array(sorted(tried)), rounds=1)
    if best is None:
        return seed, 0.0
    return replace(seed, start=start(best[0])), 1.0 - best[1] / left.total
