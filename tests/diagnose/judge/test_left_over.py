"""What a hypothesis leaves and what that looks like, of plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.judge.left_over import left_over
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, weighed

CASE = case_of(PlainEvidence((PlainFit(100.0),)))
LUMP = effect("added_mass", nodes=(9,))
FOUND = weighed(PlainFit(10.0), LUMP)


def swinging(node: int):
    return effect("attached_resonator", nodes=(node,))


def with_one(misfit: float, *more):
    return weighed(PlainFit(misfit), LUMP, *more)


@pytest.mark.parametrize(
    ("tried", "says"),
    [
        pytest.param([], "What is left is 10.", id="nothing beside it was tried"),
        pytest.param([with_one(6.0, swinging(2))], "What is left is 10.", id="not half of it"),
        pytest.param(
            [with_one(2.0, swinging(2), swinging(3))], "What is left is 10.", id="two more"
        ),
        pytest.param(
            [weighed(PlainFit(2.0), swinging(2))], "What is left is 10.", id="not beside it"
        ),
        pytest.param(
            [with_one(4.0, swinging(2))],
            "What is left is 10; some attached resonator at node 2 would take away 60 % of it.",
            id="at one place",
        ),
        pytest.param(
            [with_one(4.0, swinging(2)), with_one(4.001, swinging(3))],
            "What is left is 10; some attached resonator at one place or another (a support that "
            "resonates looks like that) would take away 60 % of it.",
            id="it swings, wherever it is put",
        ),
        pytest.param(
            [with_one(4.0, swinging(2)), with_one(2.0, effect("grounding_spring", nodes=(1,)))],
            "What is left is 10; some grounding spring at node 1 would take away 80 % of it.",
            id="the likeliest",
        ),
    ],
)
def test_what_is_left_looks_like_what_halves_it(tried, says) -> None:
    assert left_over(FOUND, [FOUND, *tried], CASE) == says


def test_where_noise_is_all_nothing_is_left() -> None:
    calm = weighed(PlainFit(1.0), LUMP)
    assert left_over(calm, [calm, with_one(0.1, swinging(2))], CASE) == ""
