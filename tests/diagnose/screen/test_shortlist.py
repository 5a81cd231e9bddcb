"""The short list, on plain fractions."""

from __future__ import annotations

from cvxupdate.diagnose.screen.shortlist import best_of, members, not_among, rounded, shortlist
from cvxupdate.diagnose.settings import EACH, MEMBERS, NEAR, SHORT
from tests.cases.plain_evidence import effect, fault, score


def names(scores) -> list[tuple[str, tuple[int, ...]]]:
    return [(s.effect.physics, s.effect.place.nodes) for s in scores]


def test_the_best_of_every_type_first_first() -> None:
    found = shortlist([score(effect("a", nodes=(1,)), 0.4), score(effect("b", nodes=(2,)), 0.9)])
    assert names(found) == [("b", (2,)), ("a", (1,))]


def test_so_many_of_a_type_and_in_all() -> None:
    alike = [score(effect("a", nodes=(n,)), 0.9 - 0.01 * n) for n in range(10)]
    other = score(effect("b", nodes=(1,)), 0.5)
    found = shortlist([*alike, other])
    assert len(found) == EACH + 1 and found[:EACH] == alike[:EACH] and found[-1] is other
    many = [score(effect(f"{k}", nodes=(1,)), 0.9 - 0.01 * k) for k in range(SHORT + 5)]
    assert shortlist(many) == many[:SHORT]
    assert len(shortlist(alike, most=2, each=9)) == 2


def test_what_comes_far_behind_the_best_is_not_refitted() -> None:
    best = score(effect("a"), 0.8)
    at, below = (score(effect(n), x * NEAR * 0.8) for n, x in (("b", 1.0), ("c", 0.99)))
    assert shortlist([best, at, below]) == [best, at]


def test_nothing_explained_and_nothing_to_be_trusted_is_left_out() -> None:
    """What a derivative says of a local effect on a table is not even what the others come near
    to."""
    wild = score(effect("a"), 1.0, trusted=False)
    real, none = score(effect("b"), 0.1), score(effect("c"), 0.0)
    assert shortlist([wild, real, none]) == [real] and shortlist([wild, none]) == []


def test_a_hypothesis_stands_there_once() -> None:
    """A hidden oscillator has a candidate for each tuning."""
    twice = [score(effect("a", nodes=(1,)), x) for x in (0.6, 0.9)]
    assert shortlist(twice) == [twice[1]]


def test_mirror_images_take_one_place_together() -> None:
    """Three images of one hypothesis do not keep out what is different; in order of the file."""
    left, right = score(effect("a", nodes=(1,)), 0.5), score(effect("a", nodes=(9,)), 0.5 + 1e-9)
    assert rounded(0.5) == rounded(0.5 + 1e-9) != rounded(0.50001)
    other, third = (score(effect("a", nodes=(n,)), x) for n, x in ((2, 0.4), (3, 0.3)))
    assert shortlist([left, right, other], each=1) == [left, right]
    assert shortlist([right, left, other], each=1) == [right, left]
    assert shortlist([left, right, other, third], each=2) == [left, right, other]
    assert shortlist([left, right, other], most=1) == [left, right]


def test_members_are_effects_of_stiffness_and_mass_on_whole_groups() -> None:
    group = score(effect("a", elements=(1, 2), groups=("bar",)), 0.1)
    better = score(effect("b", elements=(3,), groups=("rod",)), 0.2)
    damped = score(effect("c", damping=True, groups=("bar",)), 0.9)
    assert members([group, better, damped, score(effect("d"), 0.9), score(fault("n1.x"), 0.9)]) == [
        better,
        group,
    ]
    many = [score(effect("a", groups=(f"{k}",)), 0.1) for k in range(MEMBERS + 3)]
    assert len(members(many)) == MEMBERS


def test_what_is_not_among_others_and_the_best_of_lists() -> None:
    low, high = score(effect("a", nodes=(1,)), 0.2), score(effect("a", nodes=(1,)), 0.6, exact=True)
    other = score(effect("b", nodes=(2,)), 0.4)
    assert not_among([low, other], [high]) == [other] and not_among([low], []) == [low]
    assert best_of([low, other], [high]) == [high, other]
    assert best_of([high], [low]) == [high] and best_of() == []
