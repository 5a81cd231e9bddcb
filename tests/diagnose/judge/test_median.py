"""What the likeliest sets have in common, on plain figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge import median as module
from cvxupdate.diagnose.judge.median import in_common, likelier_part, median
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, rig, weighed

BASE = PlainFit(100.0, errors=Errors(0.5, 0.5), independent=20.0)
BEST = PlainFit(1.0, errors=Errors(0.02, 0.02), independent=20.0)
FEET, TRUE, ALONE = rig(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,))
OTHERS = tuple(effect("added_mass", nodes=(n,)) for n in range(4, 12))
CASE = case_of(PlainEvidence(bases=(BASE,)))


def behind(by: float) -> PlainFit:
    """A fit whose evidence is ``by`` (natural logarithm) behind that of `BEST`."""
    return replace(BEST, misfit=math.exp(2.0 * by / BEST.independent))


def test_what_is_common_to_the_likeliest_sets_is_fitted_by_itself(monkeypatch) -> None:
    """One thing in all of them, and each with another beside (the laboratory's 4339)."""

    def left_of(evidence, h: Hypothesis, *gone: int) -> Hypothesis:
        kept = tuple(e for k, e in enumerate(h.effects) if k not in gone)
        return Hypothesis(kept, replace(h.fit, p=np.zeros(len(kept))))

    monkeypatch.setattr(module, "without", left_of)
    monkeypatch.setattr(module, "refitted", lambda _, seed, effort: Hypothesis(seed.effects, BEST))
    larger = [weighed(BEST, FEET, TRUE, other) for other in OTHERS]
    field = [*larger, weighed(behind(4.0), FEET, ALONE)]
    found = median(field, CASE)
    assert found is not None and found.keys == {FEET.key, TRUE.key}


def test_what_was_fitted_is_not_fitted_again() -> None:
    larger = [weighed(BEST, FEET, TRUE, other) for other in OTHERS]
    assert median([*larger, weighed(behind(9.0), FEET, TRUE)], CASE) is None
    assert median([weighed(BEST, FEET), weighed(BEST, TRUE), weighed(BEST, ALONE)], CASE) is None
    assert median([], CASE) is None


@pytest.mark.parametrize(("left", "stands"), [(1.2, True), (60.0, False)])
def test_it_stands_in_place_of_what_is_hardly_there(left: float, stands: bool) -> None:
    """Where it can be believed, be it a little less likely by itself."""
    larger = [weighed(BEST, FEET, TRUE, other) for other in OTHERS]
    decided = weighed(replace(BEST, misfit=1.1), FEET, ALONE)
    common = weighed(replace(BEST, misfit=left), FEET, TRUE)
    tried = [*larger, decided, common]
    found = in_common(decided, tried, tried, CASE)
    assert found is (common if stands else decided)


def test_what_is_all_likelier_than_not_stays() -> None:
    decided, other = weighed(BEST, FEET, TRUE), weighed(behind(6.0), FEET, ALONE)
    assert in_common(decided, [decided, other], [decided, other], CASE) is decided
    small, larger = weighed(behind(6.0), FEET), weighed(BEST, FEET, TRUE)
    assert in_common(small, [small, larger], [small, larger], CASE) is small


@pytest.mark.parametrize(
    ("left", "instead"),
    [
        pytest.param(1.0, True, id="as near by itself"),
        pytest.param(2.0, False, id="less likely by itself"),
    ],
)
def test_a_likelier_part_is_told_in_place_of_the_whole(left: float, instead: bool) -> None:
    """A joint stood in all that was likely, beside a foot that turns, which was likelier alone (the
    laboratory's 3181)."""
    whole = weighed(BEST, FEET, TRUE)
    part = weighed(replace(BEST, misfit=left), TRUE)
    other = weighed(BEST, ALONE)
    assert likelier_part(whole, [whole, other, part], CASE) is (part if instead else whole)


def test_a_part_that_is_not_to_be_believed_is_not_told() -> None:
    far = replace(BEST, misfit=60.0, errors=Errors(0.3, 0.3))
    whole, part = weighed(far, FEET, TRUE), weighed(far, TRUE)
    assert log_odds(part, CASE) > log_odds(whole, CASE)
    assert likelier_part(whole, [part], CASE) is whole
