"""What is worth a refit beside a fitted hypothesis."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, further, seeds_from
from cvxupdate.diagnose.nominal.wanted import by_tables_alone
from cvxupdate.diagnose.screen.shortlist import not_among, shortlist
from cvxupdate.diagnose.settings import ALTERNATIVES, EACH_SIZED, HALVED, SEVERAL_LEVEL, SHORT
from cvxupdate.diagnose.types import Evidence, Key, Score, Seed
from cvxupdate.physics.effect import MODES, Effect, HiddenOscillator


def beside(
    evidence: Evidence,
    parent: Hypothesis,
    also: Collection[Key] = (),
    level: int = SEVERAL_LEVEL,
    scores: Sequence[Score] | None = None,
    wanted: Callable[[Sequence[Effect]], Sequence[Effect]] = list,
) -> list[Seed]:
    """What shows there to first order (``scores``: already screened, and placed); and what shows
    at finite sizes beside its effects alone, with nuisance parameters nominal (``also``: these
    too, however little they show). The refits are to begin at ``level``; ``wanted`` are those of
    all candidates that are tried. Of
    tables alone the best of each type enter by themselves, however many types come near: nuisance
    parameters, fitted with one, change their order far more than noise does."""
    model = parent.fit.setting.model
    effects = wanted(further(evidence.candidates(model), parent))
    near: list[Score] = []
    if scores is None:
        near = shortlist(evidence.first_order(parent.fit, effects))
    nominal = at_nominal(evidence, parent)
    sized = evidence.finite_size(nominal.fit, parent.fit, parent.effects, effects)
    all_types = by_tables_alone(evidence) and not parent.effects
    most = len(sized.scores) if all_types else SHORT
    exact = [*shortlist(sized.scores, most, EACH_SIZED)]
    swinging = _swinging(sized.scores) if evidence.told_by == MODES else []
    exact += not_among(swinging, exact)
    exact += [s for s in sized.scores if s.effect.key in also and s not in exact]
    return [
        *seeds_from(evidence, nominal, exact, level, nominal=True),
        *seeds_from(evidence, parent, near, level),
        *(_at(evidence, seed, level) for seed in sized.seeds),
    ]


def _swinging(scores: Sequence[Score]) -> list[Score]:
    """Hidden oscillators that leave no more than twice what the best of them does, as many as are
    refitted of all else: what tells their places apart is small beside the mode that they bring,
    and shows only once the rest is fitted again."""
    own = [s for s in scores if isinstance(s.effect.action, HiddenOscillator)]
    least = min((1.0 - s.fraction for s in own), default=0.0)
    near = [s for s in own if HALVED * (1.0 - s.fraction) <= least]
    return sorted(near, key=lambda s: -s.fraction)[:SHORT]


def narrow(evidence: Evidence) -> list[Seed]:
    """Hidden oscillators at finite sizes, on recordings as sharp as where several effects are
    sought, where the refits begin: smoother ones show little of a resonance."""
    if evidence.levels <= SEVERAL_LEVEL:
        return []
    parent = Hypothesis((), evidence.bases[SEVERAL_LEVEL])
    nominal = at_nominal(evidence, parent, SEVERAL_LEVEL)
    effects = [
        e for e in evidence.candidates(evidence.model) if isinstance(e.action, HiddenOscillator)
    ]
    found = evidence.finite_size(nominal.fit, parent.fit, (), effects).scores
    exact = shortlist(found, EACH_SIZED, EACH_SIZED)
    return seeds_from(evidence, nominal, exact, SEVERAL_LEVEL, nominal=True)


def _at(evidence: Evidence, seed: Seed, level: int) -> Seed:
    return Seed(seed.effects, evidence.at_level(seed.setting, level), seed.start, seed.continued)


def alternatives_to(evidence: Evidence, parent: Hypothesis) -> list[Key]:
    """What would explain more beside a fitted hypothesis, to first order: it may take the place of
    one of its effects."""
    scores = evidence.first_order(parent.fit, evidence.candidates(parent.fit.setting.model))
    return [s.effect.key for s in shortlist(scores, ALTERNATIVES, ALTERNATIVES)]
