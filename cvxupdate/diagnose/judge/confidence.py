"""How sure a finding is: how far ahead of the next thing that is something else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.hypothesis import Figures
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.alternatives import has, rivals
from cvxupdate.diagnose.settings import LEAST_SURE, MOST_SURE
from cvxupdate.physics.effect import Effect


@dataclass(frozen=True)
class Standing:
    """What the confidence in an effect rests on; logarithms are decimal.

    ``lead``: misfit of the next hypothesis without anything at its place, over the best (log);
    ``gain``: misfit of the nuisance parameters alone over the best (log); ``left``: the best misfit
    (log); ``weight``: its size in its own deviations (log); ``rivals``: how many hypotheses without
    it come as near as the best; ``alike``: how many have something else at its place.
    """

    lead: float
    gain: float
    left: float
    weight: float
    rivals: int
    alike: int

    @property
    def confidence(self) -> float:
        """1 − (misfit ratio), within bounds, shared among rivals elsewhere."""
        alone = np.clip(1.0 - 10.0 ** -max(self.lead, 0.0), LEAST_SURE, MOST_SURE)
        return float(alone) / (1.0 + 0.5 * self.rivals)


@dataclass(frozen=True)
class Competitor:
    """Another hypothesis: its misfit, whether it has something at the place in question, whether
    it is among the `rivals`."""

    misfit: float
    there: bool
    rival: bool


def standing(number: int, best: Weighed, others: Sequence[Weighed], case: Case) -> Standing:
    """Of effect ``number`` of the best hypothesis among all that were refitted."""
    effect = best.hypothesis.effects[number]
    near = {id(w) for w in rivals(best, others, case)}
    field = [
        Competitor(case.scale(w), has(w.hypothesis, effect, case.evidence.model), id(w) in near)
        for w in others
        if w is not best
    ]
    size = size_of(effect, best.hypothesis.figures[number])
    return standing_of(case.scale(best), case.scale(case.base), field, size)


def standing_of(mine: float, base: float, field: Sequence[Competitor], size: float) -> Standing:
    """From the misfits of the best (``mine``), of the nuisance parameters alone (``base``) and of
    all others; ``size`` in deviations."""
    following = min([c.misfit for c in field if not c.there] + [base])
    near = [c for c in field if c.rival]

    def log(x: float) -> float:
        return float(np.log10(np.clip(x, 1e-3, 1e4)))

    there = sum(c.there for c in near)
    floor = max(mine, 1e-9)
    return Standing(
        log(following / floor), log(base / floor), log(mine), log(size), len(near) - there, there
    )


def size_of(effect: Effect, figures: Figures) -> float:
    """An effect's size in its own deviations; infinite where no effect is no number (a rigid
    joint)."""
    q = effect.figures[0]
    if q.nothing is None:
        return np.inf
    return abs(figures.values[q.name] - q.nothing) / max(figures.deviations[q.name], 1e-12)
