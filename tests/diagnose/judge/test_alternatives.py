"""What stands at the same place, and what may stand for an effect, on plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.judge.alternatives import (
    equivalents,
    has,
    nodes_of,
    of_a_change,
    overlapping,
    spread_over,
)
from cvxupdate.diagnose.settings import SIZED
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.place import Place
from tests.cases.plain_evidence import (
    CHAIN,
    PlainFit,
    effect,
    fault,
    supposed,
)

BEST = PlainFit(1.0, errors=Errors(0.02, 0.05), rows=1000)


def test_equivalents_are_the_odd_ones_out_of_rivals_that_share_the_rest() -> None:
    a, b, c, d = (effect(nodes=(n,)) for n in (1, 2, 3, 4))
    best = supposed(BEST, a, b)
    others = [supposed(BEST, *pair) for pair in ((c, b), (a, d), (c, d), (b, c))]
    assert equivalents(a, best, others) == [(c, 0)]
    assert equivalents(b, best, others) == [(d, 1)]
    assert equivalents(a, supposed(BEST, a), [supposed(BEST, c), supposed(BEST, d)]) == [
        (c, 0),
        (d, 1),
    ]


def test_what_a_rival_has_beside_the_effect_stands_for_nothing() -> None:
    """The strangers' lump was said not to be told from a stiffness that went beside it."""
    a, b, c = (effect(nodes=(n,)) for n in (1, 2, 3))
    assert equivalents(a, supposed(BEST, a), [supposed(BEST, a, b), supposed(BEST, c)]) == [(c, 1)]


def test_a_size_is_as_sure_as_the_places_hardly_told_from_its_own_let_it_be() -> None:
    a, b, c, d = (effect(nodes=(n,)) for n in (1, 2, 3, 4))
    best = supposed(BEST, a, b, size=0.5, std=0.1)
    near = [
        (supposed(BEST, c, b, size=0.9, std=0.2), 4.0),
        (supposed(BEST, d, b, size=5.0, std=0.2), 1.0),  # no place alike
        (supposed(BEST, c, size=5.0, std=0.2), 1.0),  # something else beside it
    ]
    spread = spread_over(0, best, [c], near)
    assert spread["factor"] == pytest.approx(((0.1**2 + (0.4**2 + 0.2**2) / 4.0) / 1.25) ** 0.5)
    assert spread_over(0, best, [], near)["factor"] == pytest.approx(0.1)


def test_a_change_is_known_no_better_than_what_the_model_makes_of_changes() -> None:
    """Masses beside a reference were off by seven of their deviations (the laboratory's 2606)."""
    h = supposed(BEST, effect(nodes=(1,)), size=0.5, std=0.001)
    spread = of_a_change(h.effects[0], h.figures[0], {"factor": 0.001})
    assert spread["factor"] == pytest.approx((0.001**2 + (SIZED * 0.5) ** 2) ** 0.5)
    assert of_a_change(h.effects[0], h.figures[0], {"factor": 0.3})["factor"] < 0.301


def test_a_place_at_which_a_size_has_no_limit_says_nothing_of_it() -> None:
    a, c = effect(nodes=(1,)), effect(nodes=(3,))
    best, rigid = supposed(BEST, a, size=0.5, std=0.1), supposed(BEST, c, size=9.0, std=99.0)
    assert spread_over(0, best, [c], [(rigid, 1.0)])["factor"] == pytest.approx(0.1)


def test_places_overlap_where_they_share_most_of_their_elements_or_a_node() -> None:

    def e(*ids: int) -> Place:
        return Place(elements=ids)

    def n(*ids: int, dof: str | None = None) -> Place:
        return Place(nodes=ids, dof=dof)

    assert overlapping(e(1, 2), e(2, 3, 1)) and overlapping(e(1, 2), e(1))
    assert not overlapping(e(1, 2), e(2, 3)) and not overlapping(e(1), e(2))
    assert overlapping(n(1, 2), n(2, 3)) and not overlapping(n(1), n(2))
    assert not overlapping(n(1, dof="x"), n(1, dof="y"))
    assert not overlapping(e(2), n(1)) and not overlapping(Place(), Place())


@pytest.mark.parametrize(
    ("elements", "nodes", "same"),
    [((2,), (1,), True), ((2,), (1, 2), True), ((2,), (3,), False), ((1, 2, 3), (1,), False)],
)
def test_elements_overlap_with_nodes_that_are_theirs(elements, nodes, same: bool) -> None:
    """A chain: spring 2 between masses 1 and 2; three springs are more than one mass."""
    a, b = Place(elements=elements), Place(nodes=nodes)
    assert overlapping(a, b, CHAIN) == overlapping(b, a, CHAIN) == same


def test_nodes_of_elements_leave_out_what_is_held() -> None:
    assert nodes_of(CHAIN, [2]) == {1, 2} and nodes_of(CHAIN, [1]) == {1}
    assert nodes_of(CHAIN, [1, 3]) == {1, 2, 3} and nodes_of(CHAIN, [99]) == set()


def test_a_hypothesis_has_an_effect_where_something_stands_at_its_place() -> None:
    here = supposed(BEST, effect(elements=(2,)), fault("n3.x"))
    assert has(here, effect("added_mass", elements=(2,)), CHAIN)
    assert has(here, effect(nodes=(1, 2)), CHAIN), "the ends of its spring"
    assert has(here, effect(nodes=(3,), dof="x"), CHAIN)
    assert not has(here, effect(nodes=(3,), dof="y"), CHAIN)
    whole = supposed(BEST, effect(elements=(1, 2, 3)))
    assert has(whole, effect(elements=(2,)), CHAIN), "it is part of the whole"
    assert not has(supposed(BEST, effect(elements=(2,))), effect(elements=(1, 2, 3)), CHAIN)
    assert not has(supposed(BEST), effect(), CHAIN)
