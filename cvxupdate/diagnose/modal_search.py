"""Words at places tried on tables of modes: to first order or at their best size, then refitted;
singles, and pairs where no single one explains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cvxupdate.diagnose.effects import Effect, regrown
from cvxupdate.diagnose.modal_fit import (
    ModalFit,
    Tables,
    error_of,
    fit_modes,
    prior_scales,
    residual_of,
)
from cvxupdate.diagnose.modal_scan import BASIS, scan, scene
from cvxupdate.diagnose.refit import CHARGE
from cvxupdate.diagnose.screen import Left, Score
from cvxupdate.diagnose.shortlist import Key
from cvxupdate.diagnose.signals import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MODES
from cvxupdate.physics.effect import Effect as Candidate
from cvxupdate.residual.modal import ModalPoint

SHORT, EACH, NEAR = (
    14,
    4,
    0.25,
)  # refitted: in all, of a word, and down to this part of the largest share
# r.m.s. relative error of the frequencies above which a derivative says little of what acts on
# whole members
FAR = 0.05
TRACED, MEMBERS = (
    24,
    6,
)  # such words followed through `WHOLE` sizes (the largest members first), and refitted
WHOLE = (
    0.05,
    0.1,
    0.2,
    0.35,
    0.6,
    1.0,
    2.0,
    4.0,
)  # of their parameter, on each side that it may take
FAINT, TOGETHER = (
    1e-9,
    256,
)  # of a column: what is left of it then is rounding; columns scored at a time
PARENTS, PARTNERS, CLOSE = (
    3,
    6,
    4.0,
    # firsts beside which a second is sought, seconds refitted beside each, misfit over the best
    # one's of a first
)


@dataclass(frozen=True)
class ModalTrial:
    """Effects on a model, fitted to the tables: r.m.s. relative error of the frequencies that were
    fitted and held out (NaN: none)."""

    effects: tuple[Effect, ...]
    fit: ModalFit

    @property
    def keys(self) -> frozenset[Key]:
        """The set of what is supposed."""
        return frozenset(e.key for e in self.effects)

    @property
    def extra(self) -> int:
        """Parameters beyond the ordinary ones."""
        return sum(e.candidate.count for e in self.effects)

    @property
    def charged(self) -> float:
        """Misfit with a charge for each parameter beyond the first of each effect."""
        return self.fit.misfit * (1.0 + CHARGE * (self.extra - len(self.effects)))

    @cached_property
    def error(self) -> float:
        """On what was fitted."""
        return error_of(self.fit.point, True)

    @cached_property
    def hold_out(self) -> float:
        """On what was held out."""
        return error_of(self.fit.point, False)

    @cached_property
    def figures(self) -> list[tuple[dict[str, float], dict[str, float]]]:
        """For every effect the contract's parameters and their deviations (linearised, grown with
        the misfit)."""
        out, model = [], self.fit.model
        at = len(model.parameters) - self.extra
        for e in self.effects:
            own = slice(at, at + e.candidate.count)
            x, dx = self.fit.point.p[own], self.fit.std[own]
            out.append(e.candidate.reported(model, model.parameters[own], x, dx))
            at += e.candidate.count
        return out


@dataclass(frozen=True)
class ModalBench:
    """What stays fixed while words come and go."""

    data: Tables
    words: tuple[str, ...]
    supports: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    tell: Callable[[str], None]

    def candidates(self, found: ModalFit, words: Sequence[str] | None = None) -> list[Candidate]:
        """Every word at every place on a fitted model."""
        m = found.model.matrices(found.point.p)
        held = tuple((n, k) for n, k in self.supports if f"n{n}.{k}" not in found.model.place)
        context = SearchContext(
            found.model,
            m.K,
            m.M,
            self.data.top,
            self.data.bottom,
            (),
            held,
            lambda node, kind: regrown(self.release(node, kind), found.model),
            0.005,
            self.data.accelerometers,
        )
        return candidates_of(context, self.words if words is None else words, MODES)


def trials_beside(bench: ModalBench, parent: ModalTrial, most: int = SHORT) -> list[ModalTrial]:
    """The most promising words beside those of ``parent``, refitted, best first."""
    base = parent.fit
    candidates = [c for c in bench.candidates(base) if c.key not in parent.keys]
    bench.tell(f"screening {len(candidates)} candidates")
    # Ordinary parameters that gave way for want of a word come back where a word is tried at its
    # best size.
    usual = np.where([q.group is not None for q in base.model.parameters], 0.0, base.point.p)
    scores = shares(base, candidates)
    large = _sized(base.point.residual.evaluate(usual, base.point), candidates)
    ranked = sorted((large.get(k, s) for k, s in enumerate(scores)), key=lambda s: -_even(s.share))
    sized = {s.candidate.key for s in large.values()}
    out = _members(bench, parent, candidates) if not parent.effects and parent.error > FAR else []
    count: dict[str, int] = {}
    for s in ranked:
        c = s.candidate
        if sum(count.values()) >= most or s.share < NEAR * ranked[0].share:
            break
        if count.get(c.physics, 0) >= EACH or c.change is None:
            continue
        count[c.physics] = count.get(c.physics, 0) + 1
        found = _planted(bench, parent, s, usual if c.key in sized else None)
        out += [] if found is None else [found]
    best: dict[frozenset[Key], ModalTrial] = {}
    for t in sorted(out, key=lambda t: _even(t.charged)):
        best.setdefault(t.keys, t)
    return list(best.values())


def _even(x: float) -> float:
    """Six digits: what mirror images of a symmetric structure share to rounding is a tie, and the
    first of them counts, on every machine the same."""
    return float(f"{x:.5e}")


def _members(
    bench: ModalBench, parent: ModalTrial, candidates: Sequence[Candidate]
) -> list[ModalTrial]:
    """Words of one parameter on whole groups, followed through several sizes; those that fit best
    somewhere are refitted from there."""
    able = [c for c in candidates if c.place.groups and c.count == 1 and c.change is not None]
    traced = [
        (best, c)
        for c in sorted(able, key=lambda c: -len(c.place.elements))[:TRACED]
        if (best := _traced(bench.data, parent, c)) is not None
    ]
    out: list[ModalTrial] = []
    for (_, size), c in sorted(traced, key=lambda item: item[0][0])[:MEMBERS]:
        bench.tell(f"refitting {c.name}")
        try:
            start = np.append(parent.fit.point.p, size)
            found = (
                None
                if c.change is None
                else fit_modes(
                    c.change.model, bench.data, start, True, like=parent.fit.point.residual
                )
            )
        except CvxupdateError:
            continue
        out += [] if found is None else [ModalTrial((*parent.effects, Effect(c)), found)]
    return out


def _traced(data: Tables, parent: ModalTrial, c: Candidate) -> tuple[float, float] | None:
    """(weighted squares, size) of the best of `WHOLE`, the modes followed from size to size; None
    where there is no structure at any."""
    if c.change is None:
        return None
    model = c.change.model
    q, out = model.parameters[-1], []
    for side in (-1.0, 1.0):
        point: ModalPoint | None = None
        for size in [side * x for x in WHOLE if q.lower < side * x < q.upper]:
            try:
                residual = (
                    residual_of(model, data, parent.fit.point.residual)
                    if point is None
                    else point.residual
                )
                point = residual.evaluate(np.append(parent.fit.point.p, size), point)
            except CvxupdateError:
                break
            values, weights, _ = point.differences
            out.append((float(np.sum((weights * values) ** 2)), size))
    return min(out, default=None)


def _sized(origin: ModalPoint, candidates: Sequence[Candidate]) -> dict[int, Score]:
    """Scores of local words at their best size, by their number: a derivative says little of a word
    that is large."""
    at, model = origin.matrices, origin.residual.model
    many = natural_modes(
        at.K,
        at.M,
        min(model.size, max(BASIS, len(origin.modes.eigenvalues))),
        rigid_body_modes(model, at.K, at.M),
    )
    around = scene(origin, prior_scales(model), many)
    return {
        k: Score(
            candidates[k], 1.0 - left / around.total if around.total > 0 else 0.0, np.array([best])
        )
        for k, (left, best) in scan(around, candidates).items()
    }


def _planted(
    bench: ModalBench, parent: ModalTrial, s: Score, usual: Real | None
) -> ModalTrial | None:
    """A candidate fitted beside ``parent``, from its first-order size or (``usual``: where
    everything else begins) its best size."""
    c, n = s.candidate, len(parent.fit.model.parameters)
    if c.change is None:
        return None
    model = c.change.model
    bench.tell(f"refitting {c.name}")
    start = np.zeros(len(model.parameters))
    start[:n] = parent.fit.point.p if usual is None else usual
    low, high = (
        np.array([getattr(q, side) for q in model.parameters[n:]]) for side in ("lower", "upper")
    )
    first = s.p if len(s.p) == c.count else np.zeros(c.count)
    start[n:] = (
        first if usual is not None else np.clip(first, np.maximum(low, -0.3), np.minimum(high, 1.0))
    )
    try:
        return ModalTrial(
            (*parent.effects, Effect(c)),
            fit_modes(model, bench.data, start, usual is not None, like=parent.fit.point.residual),
        )
    except CvxupdateError:
        return None


def pairs(
    bench: ModalBench, ordinary: ModalTrial, singles: Sequence[ModalTrial]
) -> list[ModalTrial]:
    """Two effects: a second sought beside each of the best firsts, then beside the second of the
    best pair alone (backfitting); best first."""
    firsts = [t for t in singles if t.charged <= CLOSE * singles[0].charged][:PARENTS]
    pool: dict[frozenset[Key], ModalTrial] = {}

    def expand(first: ModalTrial) -> None:
        for t in trials_beside(bench, first, PARTNERS):
            if t.keys not in pool or _even(t.charged) < _even(pool[t.keys].charged):
                pool[t.keys] = t

    for first in firsts:
        expand(first)
    best = min(pool.values(), key=lambda t: _even(t.charged), default=None)
    if best is not None and frozenset((best.effects[-1].key,)) not in {t.keys for t in firsts}:
        alone = _alone(bench, ordinary, best)
        if alone is not None:
            expand(alone)
    return sorted(pool.values(), key=lambda t: _even(t.charged))


def _alone(bench: ModalBench, ordinary: ModalTrial, pair: ModalTrial) -> ModalTrial | None:
    """The second effect of a pair by itself."""
    last = pair.effects[-1]
    c = next(
        (c for c in bench.candidates(ordinary.fit, (last.candidate.physics,)) if c.key == last.key),
        None,
    )
    return (
        None
        if c is None
        else _planted(bench, ordinary, Score(c, 1.0, pair.fit.point.p[-c.count :]), None)
    )


def shares(base: ModalFit, candidates: Sequence[Candidate]) -> list[Score]:
    """Score of every candidate to first order: the share of the weighted residual that it explains,
    the ordinary parameters taken out, and its size."""
    point = base.point
    A, _ = point.system().weighted()
    values, weights, _ = point.differences
    scales = prior_scales(base.model)
    Q, _ = np.linalg.qr(np.vstack([A, np.diag(1.0 / scales)]))
    r = np.concatenate([-weights * values, -point.p / scales])
    left = Left(r - Q @ (Q.T @ r), Q, len(values))
    K, M = point.matrices.K, point.matrices.M
    many = natural_modes(K, M, min(base.model.size, 120), rigid_body_modes(base.model, K, M))
    phi = np.vstack([many.shapes, np.zeros((1, many.shapes.shape[1]))])
    column = _column(point, many.eigenvalues, phi)
    single: dict[tuple[str, int], Real] = {}
    columns: list[Real | None] = []
    for c in candidates:
        change = c.change
        members = change.members if change is not None and change.additive else ()
        parts = [single[c.physics, e] for e in members if (c.physics, e) in single]
        if len(members) > 1 and len(parts) == len(members):
            columns.append(np.sum(parts, axis=0)[:, None])
        elif change is not None and all(change.tangent):
            columns.append(np.stack([column(blocks) for blocks in change.tangent], axis=1))
        else:
            columns.append(None)
        if len(members) == 1 and (J := columns[-1]) is not None:
            single[c.physics, members[0]] = J[:, 0]
    return _scored(left, candidates, [None if J is None else weights[:, None] * J for J in columns])


def _scored(
    left: Left, candidates: Sequence[Candidate], columns: Sequence[Real | None]
) -> list[Score]:
    """Scores of candidates with weighted columns (rows, n) each (None: it has none); those with a
    single one at a time."""
    out = [Score(c, 0.0, np.zeros(c.count)) for c in candidates]
    total = float(left.residual @ left.residual)
    if total <= 0.0:
        return out
    alone = [k for k, J in enumerate(columns) if J is not None and J.shape[1] == 1]
    for first in range(0, len(alone), TOGETHER):
        some = alone[first : first + TOGETHER]
        J = np.hstack([x for k in some if (x := columns[k]) is not None])
        Jp = left.freed(J)
        norms = np.linalg.norm(Jp, axis=0)
        along = left.residual @ Jp
        for k, norm, length, push in zip(
            some, norms.tolist(), np.linalg.norm(J, axis=0).tolist(), along.tolist(), strict=True
        ):
            if norm > FAINT * max(length, 1e-300) and not (candidates[k].sign > 0 and push < 0.0):
                out[k] = Score(candidates[k], push**2 / norm**2 / total, np.array([push / norm**2]))
    for k, several in enumerate(columns):
        if several is not None and several.shape[1] > 1:
            out[k] = _together(left, candidates[k], several)
    return out


def _together(left: Left, c: Candidate, J: Real) -> Score:
    """Score of a candidate with several weighted columns ``J`` (rows, n)."""
    nothing = Score(c, 0.0, np.zeros(c.count))
    Jp, total = left.freed(J), float(left.residual @ left.residual)
    norms = np.linalg.norm(Jp, axis=0)
    if np.any(norms <= FAINT * np.maximum(np.linalg.norm(J, axis=0), 1e-300)):
        return nothing
    best = np.linalg.lstsq(Jp / norms, left.residual, rcond=1e-8)[0] / norms
    rest = left.residual - Jp @ best
    return (
        nothing
        if c.sign > 0 and best[0] < 0.0
        else Score(c, 1.0 - float(rest @ rest) / total, best)
    )


def _column(point: ModalPoint, eigenvalues: Real, phi: Real) -> Callable[[Sequence[Any]], Real]:
    """What gives the derivative of the rows of ``point.differences`` along one tangent: Fox and
    Kapoor's modal expansion over the modes at hand."""
    residual = point.residual
    places = np.array(
        [i for k in range(len(residual.fit)) for i in point.places[k].tolist() if i >= 0],
        dtype=np.int64,
    )
    shapes = np.vstack([point.modes.shapes, np.zeros((1, point.modes.shapes.shape[1]))])
    paired, own = np.ascontiguousarray(shapes[:, places]), point.modes.eigenvalues[places]
    rows = point._shape_rows() if residual.shapes else []

    def column(blocks: Sequence[Any]) -> Real:
        parts = [_energies(paired, own, blocks)]
        for _, _, i, sensors, x, std in rows:
            parts.append(
                _turned(
                    shapes[:, i],
                    float(point.modes.eigenvalues[i]),
                    sensors,
                    x,
                    std,
                    eigenvalues,
                    phi,
                    blocks,
                )
            )
        return np.concatenate(parts)

    return column


def _energies(shapes: Real, eigenvalues: Real, blocks: Sequence[Any]) -> Real:
    """φᵀ (∂K − λ ∂M) φ of each of ``shapes`` (N + 1, modes); the last DOF is the ground."""
    out = np.zeros(len(eigenvalues))
    for b in blocks:
        local = shapes[b.dofs]  # (elements, dofs, modes)
        if b.K is not None:
            out += np.einsum("eim,eim->m", local, b.K @ local)
        if b.M is not None:
            out -= eigenvalues * np.einsum("eim,eim->m", local, b.M @ local)
    return out


def _turned(
    shape: Real,
    eigenvalue: float,
    sensors: Any,
    x: Real,
    std: Real,
    eigenvalues: Real,
    phi: Real,
    blocks: Sequence[Any],
) -> Real:
    """Derivative of a shape (N + 1,) at ``sensors``, scaled to the measured ``x`` all the while."""
    force = _push(shape, eigenvalue, blocks)
    gap = eigenvalue - eigenvalues
    near = np.abs(gap) <= 1e-6 * max(eigenvalue, 1.0)
    d = phi[sensors] @ np.where(near, 0.0, (phi.T @ force) / np.where(near, 1.0, gap))
    w = 1.0 / std**2
    own = shape[sensors]
    q = np.sum(w * own * x) / np.sum(w * own**2)
    return np.asarray(q * d + own * (np.sum(w * (x - 2.0 * q * own) * d) / np.sum(w * own**2)))


def _push(shape: Real, lam: float, blocks: Sequence[Any]) -> Real:
    """(∂K − λ ∂M) φ, (N + 1,); the last DOF is the ground, where nothing moves."""
    out = np.zeros(len(shape))
    for b in blocks:
        local = shape[b.dofs]
        push = np.zeros(b.dofs.shape)
        if b.K is not None:
            push += np.einsum("eij,ej->ei", b.K, local)
        if b.M is not None:
            push -= lam * np.einsum("eij,ej->ei", b.M, local)
        np.add.at(out, b.dofs, push)
    out[-1] = 0.0
    return out
