"""How sure a finding is: the probability of all that has it, among all that was tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from cvxupdate.diagnose.budget import most_sure
from cvxupdate.diagnose.hypothesis import Figures
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.posterior import (
    beside_all,
    favoured,
    field_of,
    log_odds,
    rivals,
    support,
    support_at,
    support_near,
    weights,
)
from cvxupdate.diagnose.settings import AS_LIKELY, MOST_SURE, STATED
from cvxupdate.physics.effect import Effect


@dataclass(frozen=True)
class Standing:
    """What the confidence in an effect rests on; logarithms are decimal.

    ``support``: posterior probability of the hypotheses that have it, and ``here`` of those that
    have one of any type at its place or at one that is hardly told from it (`Evidence.alike`);
    ``gain``: misfit of the nuisance parameters alone over the best (log); ``left``: the best misfit
    (log); ``weight``: its size in its own deviations (log); ``rivals``: how many hypotheses are no
    less likely than strong evidence would tell; ``most`` that may be stated; ``untold``: where else
    it may be for all that any recording says, not refitted; ``otherwise``: something else there is
    strongly favoured over it; ``region``: probability of the hypotheses that have an effect of its
    type no further from it than an engineer looks at once.
    """

    support: float
    here: float
    gain: float
    left: float
    weight: float
    rivals: int
    most: float = MOST_SURE
    untold: tuple[Effect, ...] = ()
    otherwise: bool = False
    region: float = 0.0

    @property
    def confidence(self) -> float:
        """Never certain: what nobody thought of was not tried."""
        return min(self.support, self.most)

    @property
    def told(self) -> bool:
        """Whether it is stated: its place, with those that are hardly told from it or hold most of
        it, or its type in the region about it, is likelier than all else together, and nothing else
        there is strongly favoured over it; what does as well there is listed beside it."""
        likely = max(self.here, self.support, self.region)
        return not self.otherwise and min(likely, self.most) >= STATED

    def to_json(self) -> dict[str, object]:
        """An entry ``standing`` of diagnosis.json; effects by their words and places."""
        untold = [{"physics": e.physics, "location": e.place.to_json()} for e in self.untold]
        return {f.name: getattr(self, f.name) for f in fields(self)} | {"untold": untold}


def standing(number: int, final: Weighed, others: Sequence[Weighed], case: Case) -> Standing:
    """Of effect ``number`` of the final hypothesis among all that were refitted."""
    effect, tried = final.hypothesis.effects[number], field_of(final, others, case)
    mine, known = case.scale(final), weights(tried, case)
    alike = case.evidence.alike(final.fit, effect)
    one = case.evidence.alike(final.fit, effect, strictly=True)
    same = untold(one, effect, final, tried)
    field, likely = beside_all(effect, final, tried, known, same)
    places = (effect.place, *(e.place for e in (*alike, *same)))
    beside = final.hypothesis.keys - {effect.key}
    model = case.evidence.model
    images = (effect, *as_likely(one, effect, final, tried, case))
    return Standing(
        sum(support(e, field, likely, model) for e in images) / len(images),
        support_at(places, field, likely, model, beside),
        _log(case.scale(case.base) / max(mine, 1e-9)),
        _log(mine),
        _log(size_of(effect, final.hypothesis.figures[number])),
        len(rivals(final, others, case)),
        most_sure(case.evidence.unfinished),
        same,
        favoured(effect, places, field, likely, model, beside),
        support_near(effect, field, likely, model),
    )


def untold(
    one: Sequence[Effect], effect: Effect, final: Weighed, field: Sequence[Weighed]
) -> tuple[Effect, ...]:
    """Of ``one``, what no recording tells from an effect of the final hypothesis (`Evidence.alike`,
    strictly), that which was not refitted."""
    rest, tried = final.hypothesis.keys - {effect.key}, {w.hypothesis.keys for w in field}
    return tuple(e for e in one if rest | {e.key} not in tried)


def as_likely(
    one: Sequence[Effect], effect: Effect, final: Weighed, field: Sequence[Weighed], case: Case
) -> tuple[Effect, ...]:
    """Of the same, that which was refitted and is as likely: what is sought beside one of them is
    sought beside that one only, so they share what each has."""
    rest = final.hypothesis.keys - {effect.key}
    least = log_odds(final, case) - AS_LIKELY
    near = {w.hypothesis.keys for w in field if log_odds(w, case) >= least}
    return tuple(e for e in one if e.key != effect.key and rest | {e.key} in near)


def certainty_of_groups(wide: Weighed, others: Sequence[Weighed], case: Case) -> float:
    """Of wrong numbers of groups among all that was refitted."""
    field = field_of(wide, others, case)
    return min(float(weights(field, case)[0]), MOST_SURE)


def _log(x: float) -> float:
    return float(np.log10(np.clip(x, 1e-3, 1e4)))


def size_of(effect: Effect, figures: Figures) -> float:
    """An effect's size in its own deviations; infinite where no effect is no number (a rigid
    joint)."""
    q = effect.figures[0]
    if q.nothing is None:
        return np.inf
    return abs(figures.values[q.name] - q.nothing) / max(figures.deviations[q.name], 1e-12)
