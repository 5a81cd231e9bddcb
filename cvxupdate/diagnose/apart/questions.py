"""What is asked of further responses: which of the effects that may stand in one place of an
explanation it is; those that the diagnosis lists, and others that do nearly as well to first
order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.apart.worth import likelihoods
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, without
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.physics.effect import Effect

RIVALS = 24  # effects that the diagnosis does not list, the nearest to first order


@dataclass(frozen=True)
class Question:
    """``members``: fitted explanations that differ in one effect; ``base``: what they share, with
    nothing in its place; ``rivals``: further effects there, with their sizes to first order.
    ``likely`` (members + rivals,) how likely each is for what was recorded, one together;
    ``unknowns`` (members + rivals,); ``misfit`` per row that the best one leaves."""

    base: ResponsePoint
    members: tuple[Hypothesis, ...]
    rivals: tuple[Score, ...]
    likely: Real
    unknowns: Real
    misfit: float

    @property
    def count(self) -> int:
        """Members and rivals."""
        return len(self.members) + len(self.rivals)


def questions(evidence: ResponseEvidence, hypotheses: Sequence[Hypothesis]) -> tuple[Question, ...]:
    """One for each effect of the first hypothesis that others replace; where they have nothing in
    common, one in place of all effects."""
    first, out = hypotheses[0], []
    for k, effect in enumerate(first.effects):
        rest = first.keys - {effect.key}
        others = [h for h in hypotheses[1:] if effect.key not in h.keys and rest <= h.keys]
        if others:
            out.append(_question(evidence, (first, *others), k))
    asked = {id(h) for q in out for h in q.members}
    if not all(id(h) in asked for h in hypotheses):
        out = [_question(evidence, tuple(hypotheses), None)]
    return tuple(out)


def _question(
    evidence: ResponseEvidence, members: tuple[Hypothesis, ...], place: int | None
) -> Question:
    best = min(members, key=lambda h: h.fit.misfit)
    bare = None if place is None else without(evidence, members[0], place)
    base = evidence.bases[-1] if bare is None else bare.fit
    shared = len(members[0].effects) - (1 if place is not None else 0)
    rivals, misfits = _rivals(evidence, base, members)
    figures = best.fit.independent
    fits = np.array([h.fit.misfit for h in members] + misfits)
    unknowns = np.array(
        [float(h.unknowns) for h in members] + [float(s.effect.count + shared) for s in rivals]
    )
    likely = likelihoods(fits, unknowns, figures, best.fit.misfit)
    point: ResponsePoint = base.point
    return Question(point, members, rivals, likely, unknowns, float(best.fit.misfit))


def _rivals(
    evidence: ResponseEvidence, base: Fit, members: Sequence[Hypothesis]
) -> tuple[tuple[Score, ...], list[float]]:
    """Effects that leave least beside the base to first order, and what they leave per row."""
    listed = {_name(e) for h in members for e in h.effects}
    effects = [e for e in evidence.candidates(base.setting.model) if _name(e) not in listed]
    left = Projection.of(linearised(base.point))
    scores = [s for s in first_order(base.point, effects, left) if s.trusted and s.fraction > 0.0]
    best = sorted(scores, key=lambda s: -s.fraction)[:RIVALS]
    return tuple(best), [left.total * (1.0 - s.fraction) / max(1, base.rows) for s in best]


def _name(effect: Effect) -> tuple[object, ...]:
    return (effect.physics, effect.place)
