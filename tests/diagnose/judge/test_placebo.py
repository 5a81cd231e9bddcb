"""Placebos, on plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.judge.placebo import placebo
from cvxupdate.diagnose.search.search import Found
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    case_of,
    effect,
    score,
    supposed,
    weighed,
)

CASE = case_of(PlainEvidence((PlainFit(100.0),)))
FINAL = weighed(PlainFit(5.0), effect(nodes=(1,)))
FAR = [effect(nodes=(n,)) for n in (2, 3, 4, 5)]


def found(entries=(), singles=(), scores=()) -> Found:
    return Found(tuple(scores), tuple(singles), (), {}, tuple(entries))


def test_chance_is_the_level_of_the_rank_test() -> None:
    """Three elsewhere, refitted, one of them as good: (1 + 1) / (1 + 3)."""
    fit, lefts = PlainFit(1.0), (0.9, 0.04, 0.3)
    entries = [(supposed(fit, e), left) for e, left in zip(FAR[:3], lefts, strict=True)]
    p = placebo(FINAL, found(entries), CASE)
    assert p is not None
    assert (p.tried, p.refitted, p.left, p.mine) == (3, 3, 0.04, 0.05)
    assert p.chance == pytest.approx(2 / 4)
    assert p.says.startswith("Check against luck: 3 other effects and places")
    end = "1 of these does as well or better (luck alone would come so far once in 2 times)."
    assert p.says.endswith(end)


def test_what_stands_at_the_same_place_is_no_placebo() -> None:
    there = effect("added_mass", nodes=(1,))
    assert placebo(FINAL, found([(supposed(PlainFit(1.0), there), 0.01)]), CASE) is None
    assert placebo(FINAL, found(scores=[score(there, 0.99)]), CASE) is None


def test_what_was_only_screened_counts_by_its_first_order_fraction() -> None:
    entries = [(supposed(PlainFit(1.0), FAR[0]), 0.6)]
    scores = [score(FAR[0], 0.99), score(FAR[1], 0.2), score(FAR[2], 0.96)]
    p = placebo(FINAL, found(entries, scores=scores), CASE)
    assert p is not None and (p.tried, p.refitted) == (3, 1), "a refit counts instead of its score"
    assert p.left == pytest.approx(0.04) and p.chance == pytest.approx(2 / 4)


def test_a_later_fit_counts_instead_of_the_first_pass() -> None:
    first = supposed(PlainFit(70.0), FAR[0])
    later = supposed(PlainFit(40.0), FAR[0])
    p = placebo(FINAL, found([(first, 0.7)], [later]), CASE)
    assert p is not None and (p.tried, p.left) == (1, pytest.approx(0.4))
    assert p.chance == pytest.approx(1 / 2)


def test_there_is_none_where_nothing_is_claimed_or_only_damping_is_at_stake() -> None:
    entries = [(supposed(PlainFit(1.0), FAR[0]), 0.6)]
    pattern = case_of(PlainEvidence((PlainFit(1.0),)), damping_only=True)
    assert placebo(FINAL, found(entries), pattern) is None
    assert placebo(weighed(PlainFit(5.0)), found(entries), CASE) is None
    assert placebo(FINAL, found(), CASE) is None
    assert placebo(FINAL, found(entries), case_of(PlainEvidence((PlainFit(0.0),)))) is None
