"""Effects at finite sizes, by a measure of what they leave; and the first steps of a model that is
far off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from
from cvxupdate.diagnose.responses.bounded import Gap, approached
from cvxupdate.diagnose.responses.finite_size import Measure, few_directions, whole_member
from cvxupdate.diagnose.responses.first_order import first_order
from cvxupdate.diagnose.responses.sets import sets_of_elements
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.screen.shortlist import best_of, members, not_among
from cvxupdate.diagnose.settings import WHOLE, WHOLES
from cvxupdate.diagnose.types import Evidence, FiniteSize, Seed
from cvxupdate.physics.effect import Effect


def at_finite_sizes(
    evidence: Evidence,
    parent: Hypothesis,
    effects: Sequence[Effect],
    left: Measure,
    sift: Projection | None = None,
) -> FiniteSize:
    """Effects beside those of a parent, which stays as it is: in closed form where one acts along
    few directions, in the basis of the lowest modes for sets of elements, and by a model for each
    size for whole members. ``left`` measures what each leaves; ``sift`` as in `few_directions`."""
    point = parent.fit.point
    linear = first_order(point, effects, sift)
    exact = best_of(
        few_directions(point, linear, left, sift), sets_of_elements(point, linear, left)
    )
    whole = not_among(members(linear), exact)[:WHOLES]
    seeds = seeds_from(evidence, parent, whole, parent.fit.setting.level)
    ranked = sorted((whole_member(point, s, left) for s in seeds), key=lambda pair: -pair[1])
    return FiniteSize(exact, [seed for seed, _ in ranked[:WHOLE]])


@dataclass(frozen=True)
class Guide:
    """How a model that is far off is brought near: by a comparison that no line can dominate
    (`cvxupdate.diagnose.responses.bounded`)."""

    evidence: Evidence

    def beside(self, parent: Hypothesis, count: int) -> list[Seed]:
        """The ``count`` effects that bring a parent, as it is, nearest, each at its best size."""
        fit = parent.fit
        effects = [
            c for c in self.evidence.candidates(fit.setting.model) if c.key not in parent.keys
        ]
        sized = at_finite_sizes(self.evidence, parent, effects, Gap.of(fit.point))
        nearest = sorted(sized.scores, key=lambda s: -s.fraction)[:count]
        seeds = seeds_from(self.evidence, parent, nearest, fit.setting.level)
        return [self._damped(parent, s) for s in (*seeds, *sized.seeds)]

    @staticmethod
    def _damped(parent: Hypothesis, seed: Seed) -> Seed:
        """With the damping of the parent, which is beside its parameters in both."""
        old, new = parent.fit.setting, seed.setting
        a, b = len(old.model.parameters), len(new.model.parameters)
        count = min(old.ratios.stop - a, new.ratios.stop - b)
        start = seed.start.copy()
        start[b : b + count] = parent.fit.p[a : a + count]
        return Seed(seed.effects, new, start, seed.continued)

    def taken(self, seed: Seed, effort: str) -> tuple[Fit, float]:
        """Fitted by that comparison from a seed, and what it leaves (0: nothing; 1: as much as two
        responses that have nothing to do with one another)."""
        return approached(seed.setting, seed.start, EFFORTS[effort])
