"""Gains of channels that the modes in responses tell, as findings on the responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.judge.acceptance import Case
from cvxupdate.diagnose.judge.confidence import Standing
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.results import Finding, Gain
from cvxupdate.diagnose.search.grown import carried
from cvxupdate.physics.effect import Effect


def with_gains(judgement: Judgement, told: Hypothesis, gains: Sequence[Gain]) -> Judgement:
    """A judgement with these gains beside what it claims, each if the responses differ by less with
    it. ``told``: what the modes have beside them, with whose nuisance parameters responses are
    compared where nothing is claimed: those of the responses alone are bent by the gains."""
    if not gains:
        return judgement
    case = judgement.case
    bare = carried(case.evidence, Hypothesis((), told.fit)) or case.base.hypothesis
    h = judgement.last.hypothesis if judgement.findings else bare
    for gain in gains:
        judgement, h = _with(judgement, h, gain)
    return judgement


def _with(judgement: Judgement, before: Hypothesis, gain: Gain) -> tuple[Judgement, Hypothesis]:
    case, effect = judgement.case, _effect(gain, judgement.case)
    if effect is None or effect.key in before.keys:
        return judgement, before
    h = together(case.evidence, before, [effect], gain.value - 1.0)
    if h is before or h.fit.excess >= before.fit.excess:
        return judgement, before
    number = next(k for k, e in enumerate(h.effects) if e.key == effect.key)
    standings = list(judgement.standings if judgement.findings else ())
    standings.insert(number, _standing(gain))
    found = replace(
        judgement,
        single=None,
        final=case.weighed(h),
        field=(),
        findings=(*judgement.findings, _finding(h, number, gain)),
        standings=tuple(standings),
        graded=None,
    )
    return found, h


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
    return Finding(
        effect.physics,
        effect.place,
        effect.title,
        values,
        spread,
        spread,
        gain.confidence,
        1.0,
        (),
        effect.says(values),
    )


def _standing(gain: Gain) -> Standing:
    """That of the modal constants: its probability is of all gains and of none."""
    weight = float(np.log10(max(abs(gain.value - 1.0), 1e-300) / max(gain.deviation, 1e-300)))
    return Standing(gain.confidence, gain.confidence, 0.0, 0.0, weight, 0)
