"""Of places that no recording tells apart the one in the middle is named."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.diagnose.judge.middle import in_the_middle
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, weighed

GOOD = PlainFit(1.0, errors=Errors(0.02, 0.02))
NODES = [effect(nodes=(n,)) for n in (1, 2, 3)]  # of a chain, a metre apart


def case(*same):
    return case_of(PlainEvidence((PlainFit(100.0),), one=same))


def test_the_middle_of_what_moves_as_one_is_named() -> None:
    """Whichever is ahead by a hair."""
    ahead = weighed(GOOD, NODES[0])
    others = [weighed(replace(GOOD, misfit=1.002), e) for e in NODES[1:]]
    assert in_the_middle(ahead, others, case(*NODES[1:])) is others[0]
    assert in_the_middle(others[1], [ahead, others[0]], case(*NODES[:2])) is others[0]


def test_what_recordings_tell_stays() -> None:
    ahead, far = weighed(GOOD, NODES[0]), weighed(replace(GOOD, misfit=2.0), NODES[1])
    assert in_the_middle(ahead, [far], case(*NODES[1:])) is ahead, "the middle is less likely"
    assert in_the_middle(ahead, [], case(*NODES[1:])) is ahead, "the middle was not fitted"
    near = [weighed(GOOD, e) for e in NODES[1:]]
    assert in_the_middle(ahead, near, case()) is ahead, "nothing moves as one with it"
    assert in_the_middle(ahead, near, case(NODES[1])) is ahead, "two have no middle"


def test_what_else_is_there_must_be_the_same() -> None:
    other = effect(elements=(3,))
    ahead = weighed(GOOD, NODES[0], other)
    alone, both = weighed(GOOD, NODES[1]), weighed(GOOD, NODES[1], other)
    assert in_the_middle(ahead, [alone], case(*NODES[1:])) is ahead
    assert in_the_middle(ahead, [alone, both], case(*NODES[1:])) is both


def test_the_middle_is_that_of_what_is_alike_likely() -> None:
    """Five places on a girder of which the last two are told from the rest."""
    five = [effect(nodes=(n,)) for n in (1, 2, 3, 4, 5)]
    tied = [weighed(GOOD, e) for e in five[:3]]
    told = [weighed(replace(GOOD, misfit=2.0), e) for e in five[3:]]
    assert in_the_middle(tied[0], [*tied[1:], *told], case(*five[1:])) is tied[1]
