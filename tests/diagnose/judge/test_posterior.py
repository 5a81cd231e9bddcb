"""Hypotheses weighed by their evidence, on plain figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.posterior import field_of, log_odds, rivals, support, weights
from cvxupdate.diagnose.settings import GAIN_STD, STRONG
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import (
    CHAIN,
    PlainEvidence,
    PlainFit,
    case_of,
    effect,
    fault,
    rig,
    weighed,
)

CASE = case_of(PlainEvidence())
BEST = PlainFit(1.0, errors=Errors(0.02, 0.05), independent=20.0)
A, B, C = effect(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,))


def behind(by: float) -> PlainFit:
    """A fit whose evidence is ``by`` (natural logarithm) behind that of `BEST`."""
    return replace(BEST, misfit=math.exp(2.0 * by / BEST.independent))


def test_each_unknown_costs_half_the_logarithm_of_the_figures() -> None:
    one, two = weighed(BEST, A), weighed(BEST, effect(count=2))
    assert log_odds(one, CASE) - log_odds(two, CASE) == pytest.approx(0.5 * math.log(20.0))
    freed = weighed(BEST, freed=3)
    assert log_odds(one, CASE) - log_odds(freed, CASE) == pytest.approx(math.log(20.0))


def test_what_is_sought_shares_its_probability_among_its_places() -> None:
    """Once, however many effects; a rig alone is a supposition of its own."""
    case = case_of(PlainEvidence(everything=(A, B, C, effect("added_mass", nodes=(3,)), rig())))
    assert case.places == 3 and CASE.places == 1
    for what in (weighed(BEST, A), weighed(BEST, A, B), weighed(BEST, rig(), A)):
        assert log_odds(what, CASE) - log_odds(what, case) == pytest.approx(math.log(3.0))
    freed = weighed(BEST, freed=1)
    assert log_odds(freed, CASE) - log_odds(freed, case) == pytest.approx(math.log(3.0))
    for what in (weighed(BEST, rig()), weighed(BEST)):
        assert log_odds(what, case) == log_odds(what, CASE)


def test_the_shear_that_theory_wants_is_no_more_sought_than_a_rig() -> None:
    """A rig that goes sideways (one unknown more) imitated it (the laboratory's 4188): misfit 1.45
    beside 0.55, and likelier, for the true set paid for hundreds of places."""
    shear = effect("shear_deformation", elements=(1, 2))
    for stocky, price in ((True, 0.0), (False, math.log(3.0))):
        known = (A, B, C, shear)
        many = case_of(PlainEvidence(everything=known, stocky=stocky))
        one = case_of(PlainEvidence(stocky=stocky))
        many.__dict__["places"] = 3
        w = weighed(BEST, rig(), shear)
        assert log_odds(w, one) - log_odds(w, many) == pytest.approx(price)
        both = weighed(BEST, shear, A)
        assert log_odds(both, one) - log_odds(both, many) == pytest.approx(math.log(3.0))


def test_the_shear_that_theory_foresees_is_no_unknown() -> None:
    """However little it may do: supports that give way along a portal, a tie by the likelihood,
    were told in its place (the laboratory's 3754). Of a part of the beams, or of another size, it
    is a finding like any other."""
    whole, part = (effect("shear_deformation", elements=e) for e in ((1, 2, 3), (1, 2)))
    names = ("stiffness_change", "shear_deformation")
    case = case_of(PlainEvidence(everything=(A, B, whole, part), names=names))
    unknown, sought = 0.5 * math.log(20.0), math.log(case.places)
    near, far = (log_odds(weighed(BEST, whole, size=size), case) for size in (1.1, 2.5))
    assert near - far == pytest.approx(unknown + sought)
    assert log_odds(weighed(BEST, part, size=1.1), case) == pytest.approx(far)
    beside = log_odds(weighed(BEST, whole, A, size=1.1), case)
    assert beside == pytest.approx(log_odds(weighed(BEST, A), case))


@pytest.mark.parametrize(
    ("off", "price"),
    [
        pytest.param(0.0, 0.0, id="as it should"),
        pytest.param(-0.15, 0.5 * (math.log(0.85) / GAIN_STD) ** 2, id="as load cells are off"),
        pytest.param(1.5, STRONG / 2.0, id="a gross mistake"),
        pytest.param(-1.0, STRONG / 2.0, id="a channel that is dead"),
        pytest.param(-2.0, 0.0, id="a wrong sign is another matter"),
    ],
)
def test_a_gain_is_the_likelier_the_less_it_is_off(off: float, price: float) -> None:
    """A softer clamp and a force channel that reads 1.85 times what it should, on a real beam, were
    half as likely as the mass at its tip, and it was said that something differs there."""
    there, right = (weighed(BEST, fault("n1.x"), size=x) for x in (off, 0.0))
    assert log_odds(right, CASE) - log_odds(there, CASE) == pytest.approx(price)


def test_what_was_held_out_decides_between_near_ties() -> None:
    one, two = weighed(behind(0.2), A), replace(weighed(BEST, B), held_out=-3.0)
    assert log_odds(one, CASE) > log_odds(two, CASE)
    likely = weights([one, two], CASE)
    assert np.log(likely[0] / likely[1]) == pytest.approx(2.8)


def test_probabilities_sum_to_one_and_go_with_the_evidence() -> None:
    field = [weighed(BEST, A), weighed(behind(1.0), B), weighed(behind(3.0), C)]
    likely = weights(field, CASE)
    assert likely.sum() == pytest.approx(1.0)
    assert np.log(likely[0] / likely[1:]) == pytest.approx([1.0, 3.0])


def test_thousands_of_lines_of_a_few_modes_count_as_few_figures() -> None:
    """Twice the misfit: one in a thousand with twenty figures, hardly told apart with two."""
    twice = replace(BEST, misfit=2.0)
    many = weights([weighed(BEST, A), weighed(twice, B)], CASE)[1]
    few = [weighed(replace(f, independent=2.0), e) for f, e in ((BEST, A), (twice, B))]
    assert many == pytest.approx(1.0 / (1.0 + 2.0**10)) and weights(few, CASE)[1] > 0.3


def test_nothing_competes_and_no_set_of_effects_twice() -> None:
    best, other = weighed(BEST, A), weighed(behind(1.0), B)
    field = field_of(best, [other, best, weighed(behind(0.5), A)], CASE)
    assert field == [best, other, CASE.base]


def test_support_is_of_all_that_have_the_effect_there() -> None:
    mass = effect("added_mass", nodes=(1,))
    field = [
        weighed(BEST, A),
        weighed(BEST, A, C),
        weighed(BEST, mass),
        weighed(BEST, B),
    ]
    likely = np.array([0.4, 0.3, 0.2, 0.1])
    assert support(A, field, likely, CHAIN) == pytest.approx(0.7), "another type is a rival"
    assert support(C, field, likely, CHAIN) == pytest.approx(0.3)


def test_rivals_are_those_against_which_there_is_no_strong_evidence() -> None:
    best = weighed(BEST, A)
    near, far = weighed(behind(0.49 * STRONG), B), weighed(behind(0.51 * STRONG), C)
    nearer = weighed(behind(0.1), effect(nodes=(9,)))
    assert rivals(best, [best, near, far, nearer], CASE) == [nearer, near]


def test_patterns_of_damping_are_weighed_by_their_strain() -> None:
    case = case_of(PlainEvidence(), damping_only=True)
    field = [
        weighed(replace(BEST, misfit=50.0, damping_strain=2.0), A),
        weighed(replace(BEST, damping_strain=6.0), B),
    ]
    likely = weights(field, case)
    assert np.log(likely[0] / likely[1]) == pytest.approx(2.0)
