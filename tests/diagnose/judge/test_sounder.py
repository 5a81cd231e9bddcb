"""The likeliest sets without what is hardly there, on plain figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge import sounder as module
from cvxupdate.diagnose.judge.sounder import sounder
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, rig, weighed

BASE = PlainFit(100.0, errors=Errors(0.5, 0.5), independent=20.0)
BEST = PlainFit(1.0, errors=Errors(0.02, 0.02), independent=20.0)
FEET, TRUE, HARDLY, OTHER = (
    rig(nodes=(1,)),
    effect(nodes=(2,)),
    effect(nodes=(3,)),
    effect(nodes=(4,)),
)
CASE = case_of(PlainEvidence(bases=(BASE,)))


def behind(by: float) -> PlainFit:
    """A fit whose evidence is ``by`` (natural logarithm) behind that of `BEST`."""
    return replace(BEST, misfit=math.exp(2.0 * by / BEST.independent))


@pytest.fixture
def plain(monkeypatch) -> None:
    """Whatever has `HARDLY` rests on it."""

    def left_of(evidence, h: Hypothesis, *gone: int) -> Hypothesis:
        kept = tuple(e for k, e in enumerate(h.effects) if k not in gone)
        return Hypothesis(kept, replace(h.fit, p=np.zeros(len(kept))))

    def hardly(h: Hypothesis, evidence) -> list[int]:
        return [k for k, e in enumerate(h.effects) if e.key == HARDLY.key]

    monkeypatch.setattr(module, "without", left_of)
    monkeypatch.setattr(module, "unsound", hardly)
    monkeypatch.setattr(module, "sound", lambda h, evidence: not hardly(h, evidence))
    monkeypatch.setattr(module, "refitted", lambda _, seed, effort: Hypothesis(seed.effects, BEST))


@pytest.mark.parametrize(("by", "count"), [(40.0, 1), (1.0, 0)])
def test_what_is_left_is_fitted_where_nothing_sound_is_as_likely(
    plain, by: float, count: int
) -> None:
    """A set of forty nats more was lost with what brought two of them (the laboratory's 4709)."""
    field = [weighed(BEST, FEET, TRUE, HARDLY), weighed(behind(by), OTHER)]
    found = sounder(field, CASE)
    assert [h.keys for h in found] == [{FEET.key, TRUE.key}] * count


def test_what_was_tried_or_leaves_nothing_is_not_fitted(plain) -> None:
    tried = weighed(behind(90.0), FEET, TRUE)
    assert sounder([weighed(BEST, FEET, TRUE, HARDLY), tried], CASE) == []
    assert sounder([weighed(BEST, HARDLY), weighed(behind(90.0), OTHER)], CASE) == []
    assert sounder([], CASE) == []
