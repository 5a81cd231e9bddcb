"""Gains of channels that the modes in responses tell, as findings on the responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.judge.acceptance import Case
from cvxupdate.diagnose.judge.confidence import Standing
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.results import Finding, Gain
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.types import Evidence
from cvxupdate.physics.effect import Effect


def with_gains(judgement: Judgement, told: Hypothesis, gains: Sequence[Gain]) -> Judgement:
    """A judgement with these gains beside what it claims, each if the responses differ by less with
    it beside what the modes have (``told``), with whose nuisance parameters they are compared:
    those of the responses alone are bent by the gains."""
    case = judgement.case
    if not gains:
        return judgement
    bare = carried(case.evidence, Hypothesis((), told.fit)) or case.base.hypothesis
    seen = carried(case.evidence, told) or bare
    h = judgement.last.hypothesis if judgement.findings else bare
    for gain in gains:
        more, grown = beside(case, seen, [gain]), beside(case, h, [gain])
        new = grown.keys - h.keys
        if not new or apart(case.evidence, more) >= apart(case.evidence, seen):
            continue
        seen, h = more, grown
        number = next(k for k, e in enumerate(h.effects) if e.key in new)
        judgement = _claimed(judgement, h, number, gain)
    return judgement


def _claimed(judgement: Judgement, h: Hypothesis, number: int, gain: Gain) -> Judgement:
    standings = list(judgement.standings if judgement.findings else ())
    standings.insert(number, _standing(gain))
    findings = (*judgement.findings, _finding(h, number, gain))
    return judgement.claiming(judgement.case.weighed(h), findings, standings)


def beside(case: Case, h: Hypothesis, gains: Sequence[Gain]) -> Hypothesis:
    """A hypothesis with gains beside it, as large as they are."""
    for gain in gains:
        effect = _effect(gain, case)
        if effect is not None and effect.key not in h.keys:
            h = together(case.evidence, h, [effect], gain.value - 1.0)
    return h


def apart(evidence: Evidence, h: Hypothesis) -> float:
    """How far responses are off, by the bounded comparison where there is one: weighted squares
    grow with every resonance that is sharper in the model."""
    near = evidence.approach
    return evidence.errors(h.fit).fit if near is None else float(near.left(h))


def _effect(gain: Gain, case: Case) -> Effect | None:
    """The candidate that it is of: of as few channels as have all of its own."""
    model = case.base.fit.setting.model
    wide = [
        (e, e.fault)
        for e in case.evidence.candidates(model, ("sensor_fault",))
        if e.fault is not None and e.fault.how == gain.how
    ]
    own = [(len(f.labels), e) for e, f in wide if set(gain.channels) <= set(f.labels)]
    return min(own, key=lambda pair: pair[0], default=(0, None))[1]


def _finding(h: Hypothesis, number: int, gain: Gain) -> Finding:
    effect, p = h.effects[number], [gain.value - 1.0]
    values, spread = effect.reported(h.fit.setting.model, (), p, [gain.deviation])
    return Finding.of(effect, values, spread, gain.confidence)


def _standing(gain: Gain) -> Standing:
    """That of the modal constants: its probability is of all gains and of none."""
    weight = float(np.log10(max(abs(gain.value - 1.0), 1e-300) / max(gain.deviation, 1e-300)))
    return Standing(gain.confidence, gain.confidence, 0.0, 0.0, weight, 0)
