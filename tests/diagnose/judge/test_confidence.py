"""Confidence from plain misfits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cvxupdate.diagnose.hypothesis import Figures
from cvxupdate.diagnose.judge.confidence import Competitor, Standing, size_of, standing, standing_of
from cvxupdate.diagnose.settings import LEAST_SURE, MOST_SURE
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.quantity import stiffness
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, weighed


def confidence(lead: float, rivals: int = 0) -> float:
    return Standing(lead, 2.0, 0.0, 1.0, rivals, 0).confidence


def test_confidence_is_what_the_ratio_of_misfits_leaves_within_bounds() -> None:
    assert confidence(1.0) == pytest.approx(0.9) and confidence(0.5) == pytest.approx(0.683772)
    assert confidence(0.0) == confidence(-2.0) == LEAST_SURE
    assert confidence(4.0) == MOST_SURE
    leads = [0.2 * k for k in range(12)]
    assert sorted(map(confidence, leads)) == [confidence(x) for x in leads]


def test_rivals_elsewhere_share_it() -> None:
    assert [confidence(1.0, n) / confidence(1.0) for n in (1, 2, 4)] == pytest.approx(
        [1 / 1.5, 1 / 2, 1 / 3]
    )


def test_the_lead_is_over_the_next_hypothesis_without_anything_at_the_place() -> None:
    field = [
        Competitor(2.0, there=True, rival=True),
        Competitor(20.0, there=False, rival=False),
        Competitor(50.0, there=False, rival=False),
    ]
    s = standing_of(1.0, 100.0, field, 30.0)
    assert (s.lead, s.gain, s.left) == pytest.approx((math.log10(20), 2.0, 0.0))
    assert s.weight == pytest.approx(math.log10(30)) and (s.rivals, s.alike) == (0, 1)


def test_nuisance_parameters_are_a_competitor_too() -> None:
    assert standing_of(1.0, 10.0, [], 5.0).lead == pytest.approx(1.0)
    late = [Competitor(1000.0, there=False, rival=False)]
    assert standing_of(1.0, 10.0, late, 5.0).lead == pytest.approx(1.0)


def test_rivals_are_counted_by_place() -> None:
    field = [Competitor(1.0, there, True) for there in (True, False, False)]
    s = standing_of(1.0, 100.0, field, 5.0)
    assert (s.rivals, s.alike, s.lead) == (2, 1, 0.0)


def test_nothing_left_and_no_size_stay_finite() -> None:
    s = standing_of(0.0, 100.0, [], math.inf)
    assert (s.lead, s.gain, s.left, s.weight) == (4.0, 4.0, -3.0, 4.0)


def test_a_size_counts_in_its_own_deviations_from_nothing() -> None:
    figures = Figures({"factor": 0.9}, {"factor": 0.02}, {"factor": 0.01})
    assert size_of(effect(), figures) == pytest.approx(5.0)
    same = Figures({"factor": 1.0}, {"factor": 0.0}, {"factor": 0.0})
    assert size_of(effect(), same) == 0.0


def test_a_joint_that_was_rigid_has_no_size() -> None:
    joint = replace(effect(), figures=(stiffness("k", "N/m", 1e-9),))
    assert size_of(joint, Figures({"k": 1e5}, {"k": 1.0}, {"k": 1.0})) == math.inf


def test_the_standing_of_each_effect_of_a_hypothesis() -> None:
    """The second stands alone at its place; another hypothesis has the first as well."""
    evidence = PlainEvidence((PlainFit(100.0, errors=Errors(0.5, 0.5)),))
    case = case_of(evidence)
    a, b = effect(elements=(1,)), effect(elements=(3,))
    good = Errors(0.02, 0.02)
    best = weighed(PlainFit(1.0, errors=good), a, b, size=0.5, std=0.01)
    one = weighed(PlainFit(1.5, errors=good), a, effect(elements=(2,)))
    poor = weighed(PlainFit(30.0, errors=Errors(0.3, 0.3)), b)
    first, second = (standing(k, best, [best, one, poor], case) for k in (0, 1))
    assert first.lead == pytest.approx(math.log10(30)) and (first.rivals, first.alike) == (0, 1)
    assert second.lead == pytest.approx(math.log10(1.5)) and (second.rivals, second.alike) == (1, 0)
    assert first.confidence > 0.9 > second.confidence
    assert first.weight == pytest.approx(math.log10(50))
