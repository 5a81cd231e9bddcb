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
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.screen.sizes import best_size
from cvxupdate.diagnose.types import Score, Seed
from cvxupdate.errors import ModelError
from cvxupdate.fe.synthesis.pieces import Receptances, Response
from cvxupdate.fe.synthesis.products import times
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.physics.low_rank import DIRECTIONS, LowRank, low_rank

# sizes: from this much of the one that rules the receptance at its own place where that is largest,
# to this much of the typical one
REACH = (0.2, 10.0)
# ratio of two sizes, as narrow as a resonance is on the widest lines; how many at most
STEP, MOST = 1.5, 48
MASSES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2)  # of hidden oscillators, of the structure's
GIVEN = (0.1, 0.3, 0.6, 0.9, 0.97)  # how far what is joined rigidly gives way
OSCILLATORS = 40  # hidden oscillators looked at: those with the largest first-order fractions
FIXTURES = 16  # supports with a mass of their own: those of which a faint one explains most
SLIGHT = 1e-3  # size of a faint one: its compliance in units of its place
SIZES = (-0.45, -0.2, -0.08, 0.08, 0.2, 0.45, 1.0)  # of what acts on elements and whole members


def few_directions(point: ResponsePoint, scores: Sequence[Score], left: Projection) -> list[Score]:
    """The scores of effects that act along few directions, each at the best of several sizes
    within its bounds; fractions are exact but for nuisance parameters (``left``). An effect that no
    size helps has none."""
    total = left.total
    if total <= 0.0:
        return []
    weights = [1.0 / s.scale() for s in point.setting.signals]
    heavy = float(point.setting.model.total_mass())
    modal = [_modal_receptance(point, r) for r in point.responses]
    out = []

    def promise(change: LowRank) -> float:
        J = left.freed(_rows(change, np.array([SLIGHT]), point, modal, weights))[:, 0]
        return float((J @ left.residual) ** 2 / max(float(J @ J), 1e-300))

    for score in _looked_at(scores, promise):
        change = low_rank(score.effect)
        if change is None:
            continue
        if score.effect.type.unlimited and point.modes.rigid:
            change = _with_loss(change, point)

        def squares(sizes: Real, lr: LowRank = change) -> Real:
            try:
                return left.remaining(_rows(lr, sizes, point, modal, weights))
            except np.linalg.LinAlgError:
                return np.full(len(sizes), np.inf)

        best = best_size(squares, _sizes(score.effect, change, point, modal[0], heavy), total)
        if best is not None:
            own = score.effect.change
            p = np.array([best[0], *np.zeros(score.effect.count - 1)])
            p = p if own is None or own.start is None else own.start(best[0])
            out.append(replace(score, fraction=1.0 - best[1] / total, p=p, exact=True))
    return out


def _with_loss(change: LowRank, point: ResponsePoint) -> LowRank:
    """Springs that hold a free structure, with the loss factor of a typical mode: rigid-body modes
    have no damping ratio, and on springs without loss they would stand out of all bounds where they
    are right."""
    zeta = float(np.median(point.damping[point.modes.rigid :])) if len(point.owner) else 0.0

    def lossy(s: Complex) -> Complex:
        return np.asarray(change.f(s) * (1.0 + 2j * zeta))

    return replace(change, f=lossy)


def _looked_at(scores: Sequence[Score], promise: Callable[[LowRank], float]) -> list[Score]:
    """All but the hidden oscillators and the resonating supports far down: the former by their
    first-order fractions, the latter by what a faint one explains."""
    tuned = [s for s in scores if isinstance(s.effect.action, HiddenOscillator)]
    dropped = {id(s) for s in sorted(tuned, key=lambda s: -s.fraction)[OSCILLATORS:]}
    swinging = [s for s in scores if s.effect.change is not None and s.effect.change.start]
    ranked = [
        (0.0 if lr is None else -promise(lr), s) for s in swinging for lr in [low_rank(s.effect)]
    ]
    dropped |= {id(s) for _, s in sorted(ranked, key=lambda item: item[0])[FIXTURES:]}
    return [s for s in scores if id(s) not in dropped]


def whole_member(parent: ResponsePoint, seed: Seed, left: Projection) -> tuple[Seed, float]:
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


def _modal_receptance(point: ResponsePoint, r: Response) -> Complex:
    """1 over the dynamic stiffness of every mode (points, modes); damping that couples modes is
    left out."""
    s = r.signal.s[:, None]
    lam = np.maximum(point.modes.eigenvalues, 0.0)
    return np.asarray(1.0 / (s**2 + point.loss.viscous(lam) * s + point.loss.stiffness(lam)))


def _at(change: LowRank, point: ResponsePoint, modal: Complex) -> Complex:
    """Receptances Wᵀ G W (points, r, r)."""
    phi = change.W.T @ point.modes.shapes[change.used]
    r, m = phi.shape
    pairs = (phi[:, None, :] * phi[None, :, :]).reshape(r * r, m).T
    return np.asarray((modal.real @ pairs + 1j * (modal.imag @ pairs)).reshape(len(modal), r, r))


def _sizes(
    effect: Effect, change: LowRank, point: ResponsePoint, modal: Complex, heavy: float
) -> Real:
    """Sizes to try, in order."""
    if isinstance(effect.action, HiddenOscillator):
        return heavy * np.array(MASSES)
    s = point.responses[0].signal.s
    diagonal = np.einsum("sii,i->si", _at(change, point, modal), change.weights)
    own = np.abs(change.f(s)[:, None] * diagonal).max(axis=1)
    largest, typical = max(float(own.max()), 1e-300), max(float(np.median(own)), 1e-300)
    reach = REACH[0] / largest, REACH[1] / typical
    steps = np.geomspace(*reach, min(MOST, 2 + int(np.log(reach[1] / reach[0]) / np.log(STEP))))
    if effect.change is not None and effect.change.series:
        # a compliance beside the place's own: what is joined rigidly gives way at most wholly
        gamma = np.unique(np.concatenate([steps[steps < 1.0], GIVEN]))
        return np.asarray(gamma / (1.0 - gamma))
    p = steps if effect.sign > 0 else np.concatenate([-steps[::-1], steps])
    return p[(p > effect.limits[0]) & (p < effect.limits[1])]


def _rows(
    change: LowRank,
    sizes: Real,
    point: ResponsePoint,
    modal: Sequence[Complex],
    weights: Sequence[Real],
) -> Real:
    """Weighted change of every row for each size, (rows, sizes)."""
    parts = []
    for r, own, g, w in zip(point.responses, modal, point.green, weights, strict=True):
        moved = _moved(change, sizes, point, r, own, g)
        points, sensors, cases, count = moved.shape
        flat = point.faulty(r.signal, moved.reshape(points, sensors, cases * count))
        rows = r.rows(flat).reshape(-1, sensors, cases, count)
        weighted = (w[..., None] * rows).reshape(-1, count)
        parts += [weighted.real, weighted.imag]
    return np.vstack(parts)


def _moved(
    change: LowRank,
    sizes: Real,
    point: ResponsePoint,
    r: Response,
    modal: Complex,
    g: Receptances,
) -> Complex:
    """The responses' change (points, sensors, cases, sizes)."""
    s = r.signal.s
    G = _at(change, point, modal)
    left, right = (times(change.W.T, x[change.used]) for x in (g.left, g.right))
    left = left * r.drive[:, None]
    if len(change.weights) == 1:
        amount = change.at(sizes, s)[:, :, 0]
        factor = amount / (1.0 + amount * G[:, 0, 0, None])
        outer = left[0][:, :, None, None] * right[0][:, None, :, None]
        return np.asarray(-outer * factor[:, None, None, :])
    one = 1.0 / (sizes * change.f(s)[:, None])  # (points, sizes)
    G = G + np.diag(change.behind)
    if len(change.weights) <= DIRECTIONS:
        inverse = np.linalg.inv(np.diag(1.0 / change.weights) * one[:, :, None, None] + G[:, None])
        return np.asarray(-np.einsum("ips,pgij,jpc->pscg", left, inverse, right, optimize=True))
    # all sizes at one cost: (Λ⁻¹ a + G)⁻¹ = Λ V (a + μ)⁻¹ V⁻¹ with G Λ = V μ V⁻¹
    mu, V = np.linalg.eig(G * change.weights)
    left = np.einsum("ips,i,pij->psj", left, change.weights, V, optimize=True)
    right = np.asarray(np.linalg.solve(V, np.moveaxis(right, 0, 1)), dtype=complex)
    factor = 1.0 / (one[:, :, None] + mu[:, None, :])
    return np.asarray(-np.einsum("psj,pgj,pjc->pscg", left, factor, right, optimize=True))
