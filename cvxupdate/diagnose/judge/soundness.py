"""What no hypothesis may rest on: a size on its bound, or one that is hardly there."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.confidence import size_of
from cvxupdate.diagnose.settings import AT_BOUND, LEAST_SIZE, MASS_STD, PIECE, STIFFNESS_STD
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics.effect import Effect


def sound(h: Hypothesis) -> bool:
    """Whether every effect's first unknown is off its bounds and at least `LEAST_SIZE` of its
    standard deviations, the usual scatter of a piece among them, from nothing; an exchange of
    channels has no size, and a compliance may be as large as it can."""
    fit, at = h.fit, len(h.fit.setting.model.parameters) - sum(e.columns for e in h.effects)
    for effect, figures in zip(h.effects, h.figures, strict=True):
        if effect.change is None:
            exchanged = effect.fault is not None and effect.fault.how == "swap"
            if not exchanged and size_of(effect, figures) < LEAST_SIZE:
                return False
        else:
            p, q = float(fit.p[at]), fit.setting.model.parameters[at]
            released = effect.change.series and p > 0.0  # a hinge is the limit of a loose joint
            deviation = float(np.hypot(fit.deviations[at], usual(effect, q)))
            if (on_bound(p, q) and not released) or _deviations(effect, p, deviation) < LEAST_SIZE:
                return False
        at += effect.columns
    return True


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


def _deviations(effect: Effect, p: float, deviation: float) -> float:
    """How many of its deviations a size is from nothing: of a compliance by the degree of fixity
    that it leaves, 1 / (1 + p) (Monforton and Wu 1963), of a spring to ground by that which it
    brings, for a support that is nearly rigid has no upper limit."""
    change, fixity = effect.change, 1.0
    if change is not None:
        fixity = 1.0 + (p if change.series else change.part * p)
    return abs(p) * abs(fixity) / max(deviation, float(np.finfo(float).tiny))


def on_bound(p: float, q: Parameter) -> bool:
    """Whether a parameter is within `AT_BOUND` of either bound (times the bound: ranges may be
    many orders of magnitude wide, and a bound at nothing is the other rule's)."""
    return any(
        np.isfinite(bound) and bound != 0.0 and abs(p - bound) <= AT_BOUND * abs(bound)
        for bound in (q.lower, q.upper)
    )
