"""Shares of candidates at several sizes, each exactly: what acts along a few directions changes a
structure's receptances in closed form.

A first-order share says nothing of an effect that carries resonances past one another: a spring to
ground under a free structure has a derivative of rigid-body motion only. For a change p f(s) W Λ Wᵀ
of the dynamic stiffness, with few columns W, the responses change by −l (Λ⁻¹ / (p f) + Wᵀ G W)⁻¹ r,
where l, r are the receptances from W to the sensors and from the drives to W (Sherman, Morrison and
Woodbury; Ewins 2000, 6.4, coupling by FRFs). Springs, lumps, dampers, joints, hidden oscillators
and slender elements are of that kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg

from cvxupdate.diagnose.effects import Hypothesis
from cvxupdate.diagnose.forward import Receptances, Response, modal_blocks
from cvxupdate.diagnose.products import times
from cvxupdate.diagnose.residual import ResponsePoint
from cvxupdate.diagnose.screen import Left, Score
from cvxupdate.diagnose.signals import Complex, Real
from cvxupdate.errors import ModelError
from cvxupdate.physics.effect import Effect, HiddenOscillator, ModelChange
from cvxupdate.physics.low_rank import LowRank, amounts, low_rank

# sizes: from this much of the one that rules the receptance at its own place where that is
# largest, to its typical one
REACH = (0.2, 10.0)
# ratio of two sizes, as narrow as a resonance is on the widest lines; how many at most
STEP, MOST = 1.5, 48
MASSES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2)  # of hidden oscillators, of the structure's
GIVEN = (0.1, 0.3, 0.6, 0.9, 0.97)  # how far what is joined rigidly gives way
FINEST = 24  # sets whose sizes are refined
BETWEEN, FINER = 4, 2  # sizes tried between the best one and its neighbours, and how often
SIZES = (-0.45, -0.2, -0.08, 0.08, 0.2, 0.45, 1.0)  # of what acts on elements and whole members
SETS = 300  # sets of elements looked at: those with the largest first-order shares
OSCILLATORS = 40  # hidden oscillators looked at: those with the largest first-order shares


def sized(point: ResponsePoint, ranked: Sequence[Score], left: Left) -> list[Score]:
    """The scores of those of ``ranked`` that act along few directions, each at the best of several
    sizes, shares exact but for ordinary unknowns (``left``: what they cannot take up at the point,
    `left_over`).

    Sizes are those within the parameter's bounds; a candidate that no size helps keeps no score.
    """
    total = float(left.residual @ left.residual)
    if total <= 0.0:
        return []
    weights = [1.0 / s.scale() for s in point.setting.signals]
    heavy = float(point.setting.model.total_mass())
    modal = [_modal_receptance(point, r) for r in point.responses]
    tuned = [s for s in ranked if isinstance(s.candidate.action, HiddenOscillator)]
    beyond = {id(s) for s in sorted(tuned, key=lambda s: -s.share)[OSCILLATORS:]}
    out = []
    for score in ranked:
        change = None if id(score) in beyond else low_rank(score.candidate)
        if change is None:
            continue
        sizes = _sizes(score.candidate, change, point, modal[0], heavy)
        best, least = 0.0, total
        for _ in range(1 + FINER):
            if not len(sizes):
                break
            try:
                columns = _responses(change, amounts(score.candidate, sizes), point, modal, weights)
            except np.linalg.LinAlgError:
                break
            norms = np.sum((left.residual[:, None] - left.freed(columns)) ** 2, axis=0)
            k = int(np.argmin(norms))
            if norms[k] >= least:
                break
            best, least = float(sizes[k]), float(norms[k])
            sizes = _between(sizes, best)
        if least < total:
            out.append(
                replace(
                    score,
                    share=1.0 - least / total,
                    p=np.array([best, *np.zeros(len(score.p) - 1)]),
                    exact=True,
                )
            )
    return out


def sized_sets(point: ResponsePoint, ranked: Sequence[Score], left: Left) -> list[Score]:
    """The same for words with one parameter that act along many directions, sets of elements first
    of all: in the basis of the point's lowest modes.

    Of those with the largest first-order shares. A thickness is taken as a plate's or a bar's in
    bending: stiffness with its cube, mass as itself.
    """
    if any(r.coupled for r in point.responses):
        return []
    total = float(left.residual @ left.residual)
    weights = [1.0 / s.scale() for s in point.setting.signals]
    low = min(point.low, *(len(r.q) for r in point.responses))
    able = [
        (s, s.candidate.change)
        for s in ranked
        if s.candidate.change is not None
        and s.candidate.change.additive
        and low_rank(s.candidate) is None
    ]

    def tried(rates: Sequence[Real], score: Score, stiff: Real, sizes: Real) -> Score | None:
        columns = np.stack(
            [
                _weighted(point, weights, _modal(point, rates, a, b))
                for a, b in zip(stiff, sizes, strict=True)
            ],
            axis=1,
        )
        norms = np.sum((left.residual[:, None] - left.freed(columns)) ** 2, axis=0)
        k = int(np.argmin(norms))
        return (
            replace(score, share=1.0 - float(norms[k]) / total, p=np.array([sizes[k]]), exact=True)
            if norms[k] < total
            else None
        )

    found: list[tuple[Score, ModelChange, Real, list[Real]]] = []
    for score, change in sorted(able, key=lambda pair: -pair[0].share)[:SETS]:
        rates: list[Real] = [np.zeros((low, low)), np.zeros((low, low))]
        for block in change.tangent[0]:
            for k, part in enumerate(modal_blocks(point.modes.shapes[:, :low], block)[:2]):
                rates[k] += 0.0 if part is None else part
        least, most = score.candidate.limits
        sizes = np.array([x for x in SIZES if least < x < most])
        first = tried(rates, score, change.stiffness_of(sizes), sizes)
        if first is not None:
            found.append((first, change, sizes, rates))
    best = sorted(found, key=lambda item: -item[0].share)
    out = [score for score, *_ in best[FINEST:]]
    for score, change, sizes, rates in best[:FINEST]:
        for _ in range(FINER):
            sizes = _between(sizes, float(score.p[0]))
            again = tried(rates, score, change.stiffness_of(sizes), sizes)
            if again is None or again.share <= score.share:
                break
            score = again
        out.append(score)
    return out


def _between(sizes: Real, best: float) -> Real:
    """Sizes on both sides of the best one."""
    k = int(np.argmin(np.abs(sizes - best)))
    return np.linspace(sizes[max(k - 1, 0)], sizes[min(k + 1, len(sizes) - 1)], BETWEEN + 2)[1:-1]


def _modal(point: ResponsePoint, rates: Sequence[Real], a: float, b: float) -> list[Complex]:
    """The responses' change (points, sensors, cases) when K̃ and M̃ in the basis of the lowest
    modes change by a, b times ``rates``; modes keep their damping in their order."""
    low = len(rates[0])
    lam = np.maximum(point.modes.eigenvalues[:low], 0.0)
    try:
        new, V = scipy.linalg.eigh(np.diag(lam) + a * rates[0], np.eye(low) + b * rates[1])
    except np.linalg.LinAlgError:
        return [np.zeros(r.raw.shape, dtype=complex) for r in point.responses]
    new = np.maximum(new, 0.0)
    slow = 2.0 * point.damping[:low] * np.sqrt(new)
    out = []
    for r in point.responses:
        s = r.signal.s
        force = r.q[:low] / r.inverse[:low, :, None]
        moved = times(V.T, force) / (s**2 + slow[:, None] * s + new[:, None])[:, :, None]
        change = times((V.T @ r.at[:low]).T, moved) - times(r.at[:low].T, r.q[:low])
        out.append(r.drive[:, None, None] * np.moveaxis(change, 0, 1))
    return out


def _weighted(point: ResponsePoint, weights: Sequence[Real], changes: Sequence[Complex]) -> Real:
    """Changes of the responses as weighted rows."""
    parts = []
    for r, w, change in zip(point.responses, weights, changes, strict=True):
        flat = (w * r.rows(point.faulty(r.signal, change))).reshape(-1)
        parts += [flat.real, flat.imag]
    return np.concatenate(parts)


def sized_whole(
    parent: ResponsePoint, hypothesis: Hypothesis, left: Left
) -> tuple[Hypothesis, float]:
    """A hypothesis beside a fitted parent with the best of several sizes of its last parameter to
    begin with, and the share it then explains.

    For what acts on whole members: too many directions for the closed form, so every size is a
    model of its own. Words with several parameters stay.
    """
    effect = hypothesis.effects[-1]
    if effect.columns != 1:
        return hypothesis, 0.0
    total = float(left.residual @ left.residual)
    before, weights, _ = parent.differences
    at = len(hypothesis.setting.model.parameters) - 1
    bound = hypothesis.setting.model.parameters[at]
    sizes = np.array(
        [float(hypothesis.start[at]), *(x for x in SIZES if bound.lower < x < bound.upper)]
    )
    best, least = hypothesis, np.inf
    for _ in range(2):
        norms = np.full(len(sizes), np.inf)
        for k, size in enumerate(sizes):
            start = hypothesis.start.copy()
            start[at] = size
            try:
                values = hypothesis.setting.evaluate(start).differences[0]
            except ModelError:
                continue
            norms[k] = float(
                np.sum(
                    (left.residual - left.freed((weights * (values - before))[:, None])[:, 0]) ** 2
                )
            )
            if norms[k] < least:
                best, least = replace(hypothesis, start=start), norms[k]
        order = np.argsort(sizes)
        k = int(np.argmin(norms[order]))
        near = sizes[order][[max(k - 1, 0), k, min(k + 1, len(sizes) - 1)]]
        sizes = np.concatenate(
            [np.linspace(near[0], near[1], 4)[1:-1], np.linspace(near[1], near[2], 4)[1:-1]]
        )
    return best, 1.0 - least / total


def _modal_receptance(point: ResponsePoint, r: Response) -> Complex:
    """1 / (s² + 2 ζ ω s + ω²) of every mode (points, modes); damping that couples modes is left
    out."""
    s = r.signal.s
    lam = np.maximum(point.modes.eigenvalues, 0.0)
    return np.asarray(
        1.0 / (s[:, None] ** 2 + 2.0 * point.damping * np.sqrt(lam) * s[:, None] + lam)
    )


def _at(change: LowRank, point: ResponsePoint, modal: Complex) -> Complex:
    """Receptances Wᵀ G W (points, r, r)."""
    phi = change.W.T @ point.modes.shapes[change.used]
    r, m = phi.shape
    pairs = (phi[:, None, :] * phi[None, :, :]).reshape(r * r, m).T
    return np.asarray((modal.real @ pairs + 1j * (modal.imag @ pairs)).reshape(len(modal), r, r))


def _sizes(e: Effect, change: LowRank, point: ResponsePoint, modal: Complex, heavy: float) -> Real:
    """Sizes p to try, in order."""
    if isinstance(e.action, HiddenOscillator):
        return heavy * np.array(MASSES)
    s = point.responses[0].signal.s
    own = np.abs(
        change.f(s)[:, None] * np.einsum("sii,i->si", _at(change, point, modal), change.weights)
    ).max(axis=1)
    largest, typical = max(float(own.max()), 1e-300), max(float(np.median(own)), 1e-300)
    reach = REACH[0] / largest, REACH[1] / typical
    steps = np.geomspace(*reach, min(MOST, 2 + int(np.log(reach[1] / reach[0]) / np.log(STEP))))
    if e.change is not None and e.change.series:  # joined rigidly: it gives way at most wholly
        gamma = np.unique(np.concatenate([steps[steps < 1.0], GIVEN]))
        return np.asarray(gamma / (1.0 - gamma))
    p = steps if e.sign > 0 else np.concatenate([-steps[::-1], steps])
    return p[(p > e.limits[0]) & (p < e.limits[1])]


def _responses(
    change: LowRank,
    gammas: Real,
    point: ResponsePoint,
    modal: Sequence[Complex],
    weights: Sequence[Real],
) -> Real:
    """Weighted change of every row for each size, (rows, sizes)."""
    parts = []
    for r, own, g, w in zip(point.responses, modal, point.green, weights, strict=True):
        moved = _moved(change, gammas, point, r, own, g)
        points, sensors, cases, sizes = moved.shape
        rows = r.rows(
            point.faulty(r.signal, moved.reshape(points, sensors, cases * sizes))
        ).reshape(-1, sensors, cases, sizes)
        flat = (w[..., None] * rows).reshape(-1, sizes)
        parts += [flat.real, flat.imag]
    return np.vstack(parts)


def _moved(
    change: LowRank, gammas: Real, point: ResponsePoint, r: Response, modal: Complex, g: Receptances
) -> Complex:
    """The responses' change (points, sensors, cases, sizes)."""
    f = change.f(r.signal.s)
    G = _at(change, point, modal)
    left, right = (times(change.W.T, x[change.used]) for x in (g.left, g.right))
    left = left * r.drive[:, None]
    if len(change.weights) == 1:
        amount = gammas[None] * (f * change.weights[0])[:, None]
        factor = amount / (1.0 + amount * G[:, 0, 0, None])
        return np.asarray(
            -(left[0][:, :, None, None] * right[0][:, None, :, None]) * factor[:, None, None, :]
        )
    inverse = np.linalg.inv(
        np.diag(1.0 / change.weights) / (gammas[None, :, None, None] * f[:, None, None, None])
        + G[:, None]
    )
    return np.asarray(-np.einsum("ips,pgij,jpc->pscg", left, inverse, right, optimize=True))
