"""What no hypothesis may rest on: a size on its bound, or one that is hardly there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Figures, Hypothesis, of_a_rig
from cvxupdate.diagnose.judge.confidence import size_of
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.settings import (
    AT_BOUND,
    LEAST_SIZE,
    MASS_STD,
    PIECE,
    SEEN_SIZE,
    STIFFNESS_STD,
    STRONG,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics.attached_resonator import hidden_label
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint


class Grounds(Protocol):
    """What of the evidence it depends on."""

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""

    @property
    def bases(self) -> Sequence[Fit]:
        """The nuisance parameters alone, last those of the sharpest recordings."""

    @property
    def file(self) -> Model | None:
        """The model as it came, where a reference state was there to bring it to."""


def sound(h: Hypothesis, evidence: Grounds, whole: bool = True) -> bool:
    """Whether no effect is `unsound`. Not the ``whole``: what a rig does may be small, and only
    what is sought beside it is asked."""
    return all(not whole and of_a_rig(h.effects[k]) for k in unsound(h, evidence))


def unsound(h: Hypothesis, evidence: Grounds) -> list[int]:
    """Effects whose first unknown is on its bounds or less than `LEAST_SIZE` of its standard
    deviations, the usual scatter of a piece among them, from nothing; an exchange of channels has
    no size, and a compliance may be as large as it can. For what is nearly free or nearly rigid has
    no upper limit, a compliance p counts by the degree of fixity that it leaves, 1 / (1 + p)
    (Monforton and Wu 1963), a spring to ground by that which it brings. An oscillator whose own
    mode was measured is there whatever its mass, beside what a rig does everywhere, if noise alone
    is left and something is clearly missing: its tuning is known, and whether anything else
    explains that mode the evidence says. Its mass must be told where a reference state had the
    mode, or something else is sought."""
    at = len(h.fit.setting.model.parameters) - sum(e.columns for e in h.effects)
    out = []
    for k, (effect, figures) in enumerate(zip(h.effects, h.figures, strict=True)):
        if effect.change is None:
            exchanged = effect.fault is not None and effect.fault.how == "swap"
            there = exchanged or size_of(effect, figures) >= _least(h, effect, figures, evidence)
        else:
            there = _there(h, effect, at, evidence)
        out += [] if there else [k]
        at += effect.columns
    return out


def _there(h: Hypothesis, effect: Effect, at: int, evidence: Grounds) -> bool:
    """Whether a change of the model, of which parameter ``at`` is the first, is off its bounds and
    far enough from nothing."""
    p, q = float(h.fit.p[at]), h.fit.setting.model.parameters[at]
    series = effect.change is not None and effect.change.series
    released = series and p > 0.0  # a hinge is the limit of a loose joint
    if on_bound(p, q) and not (released or effect.type.total):
        return False
    deviation = float(np.hypot(h.fit.deviations[at], usual(effect, q)))
    deviations = abs(p) / max(deviation, float(np.finfo(float).tiny))
    if series:
        deviations *= abs(1.0 + p)
    elif effect.type.unlimited and deviations < LEAST_SIZE:
        deviations *= fixity(h, at, evidence.band[0])
    return deviations >= LEAST_SIZE


def _least(h: Hypothesis, effect: Effect, figures: Figures, evidence: Grounds) -> float:
    """The deviations that a size must be from nothing."""
    own = _own_modes(h, effect, figures)
    if not own:
        return LEAST_SIZE
    if evidence.file is None:  # how much it takes of what else is sought its mass would say
        there = _clearly(h, evidence) and all(e is effect or _everywhere(e) for e in h.effects)
    else:
        there = any(_came(table, row) for table, row in own)
    return 0.0 if there else SEEN_SIZE


def _clearly(h: Hypothesis, evidence: Grounds) -> bool:
    """Whether a set leaves noise alone, of shapes, too, and is strongly likelier than nothing: a
    few frequencies any oscillator meets."""
    nothing, point = Hypothesis((), evidence.bases[-1]), h.fit.point
    shapes = isinstance(point, ModalPoint) and bool(point.residual.shapes)
    return shapes and h.fit.spent and merit(h) > merit(nothing) + STRONG / 2.0


def _everywhere(e: Effect) -> bool:
    """Whether a rig does it wherever it can."""
    at_one_place = len(e.place.nodes) == 1 or len(e.place.elements) == 1
    return of_a_rig(e) and (e.type.mount or not at_one_place)


def _came(table: ModeTable, row: int) -> bool:
    """Whether a mode, or one next to it by frequency, is none that the reference has: an oscillator
    makes two of one, and which of them came shapes do not always tell."""
    order = np.argsort(table.frequency, kind="stable").tolist()
    at = order.index(row)
    return bool(np.any(table.pairs[order[max(at - 1, 0) : at + 2]] <= 0))


def _own_modes(h: Hypothesis, effect: Effect, figures: Figures) -> list[tuple[ModeTable, int]]:
    """The measured modes (table, row) that are for the most part, by kinetic energy, the motion of
    a hidden oscillator: its tuning is known then."""
    point = h.fit.point
    if not (isinstance(effect.action, HiddenOscillator) and isinstance(point, ModalPoint)):
        return []
    at = point.residual.model.labels.index(
        hidden_label(f"n{effect.place.nodes[0]}", str(effect.place.dof))
    )
    swings = figures.values["m"] * point.modes.shapes[at] ** 2 >= 0.5
    return [
        (table, row)
        for table, places in zip(point.residual.fit, point.places, strict=False)
        for row, mode in enumerate(places.tolist())
        if mode >= 0 and swings[mode]
    ]


def said_plainly(h: Hypothesis) -> bool:
    """Whether an effect says no more than a plainer one at its place: that is another hypothesis,
    and a place counts once."""
    pairs = zip(h.effects, h.figures, strict=True)
    return any(e.type.plainly(f.values, f.deviations) for e, f in pairs if e.count > 1)


def usual(effect: Effect, q: Parameter) -> float:
    """Standard deviation that a factor on a set of elements has without anything being wrong: what
    is drawn as equal is never quite equal. Nothing for other effects."""
    if effect.change is None or not effect.change.members:
        return 0.0
    return PIECE * {"stiffness": STIFFNESS_STD, "mass": MASS_STD}.get(q.of, 0.0)


def fixity(h: Hypothesis, at: int, bottom: float) -> float:
    """By what springs to ground, parameter ``at`` of a fitted model, make the structure stiffer at
    their place: 1 + k a with the flexibility a without them, 1 / (1 - k a') beside them."""
    p, omega = h.fit.p, 2.0 * np.pi * bottom
    taken = float(p[at]) * share_per_size(h.fit.setting.model, p, at, omega)
    return 1.0 / max(1.0 - taken, float(np.finfo(float).eps))


def share_per_size(model: Model, p: Real, number: int, omega: float) -> float:
    """What springs, whose stiffness a parameter scales, take of a force at them in the mean, per
    unit of the parameter: tr(K' A⁻¹) / n with A = K + ω² M at ``p``, ``omega`` in rad/s, so that
    what nothing else holds is held by its inertia."""
    matrices = model.matrices(p[: len(model.parameters)])
    factors = factored((matrices.K + omega**2 * matrices.M).tocsc(), "the stiffness matrix")
    share, count = 0.0, 0
    for block in model.derivative(number):
        if block.K is None:
            continue
        for dofs, K in zip(block.dofs, block.K, strict=True):
            rows, free = dofs[dofs >= 0], dofs >= 0
            forces = np.zeros((model.size, len(rows)))
            forces[rows, np.arange(len(rows))] = 1.0
            share += float(np.sum(K[np.ix_(free, free)] * factors.solve(forces)[rows]))
            count += len(rows)
    return share / max(count, 1)


def on_bound(p: float, q: Parameter) -> bool:
    """Whether a parameter is within `AT_BOUND` of either bound (times the bound: ranges may be
    many orders of magnitude wide, and a bound at nothing is the other rule's)."""
    return any(
        np.isfinite(bound) and bound != 0.0 and abs(p - bound) <= AT_BOUND * abs(bound)
        for bound in (q.lower, q.upper)
    )
