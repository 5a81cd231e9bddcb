"""The same said with fewer unknowns, of plain effects."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.hypothesis import FIXTURE, Hypothesis, further
from cvxupdate.diagnose.search.plainer import covers, says
from tests.cases.plain_evidence import PlainFit, effect, supposed


def softer(*elements: int):
    return effect("stiffness_change", elements=elements)


def joint(element: int, node: int):
    return effect("joint_flexibility", elements=(element,), nodes=(node,), dof="ry")


@pytest.mark.parametrize("run", [(7, 8), (8, 9)])
def test_a_joint_and_a_softer_element_beside_it_may_be_a_run(run) -> None:
    assert says(softer(*run), [softer(8), joint(8, 9)])
    assert says(softer(8, 9), [joint(9, 9), softer(8)])


def test_not_a_run_that_is_longer_or_leaves_one_out() -> None:
    assert not says(softer(7, 8, 9, 10), [softer(8), joint(8, 9)])
    assert not says(softer(9, 10), [softer(8), joint(9, 9)])
    assert not says(effect("mass_change", elements=(8, 9)), [softer(8), joint(8, 9)])


def test_a_fixture_may_be_a_spring_in_one_of_its_directions() -> None:
    fixture = effect(FIXTURE, count=4, nodes=(1,))
    spring = effect("grounding_spring", nodes=(1,), dof="ry")
    assert says(spring, [fixture]) and says(
        effect(FIXTURE, count=2, nodes=(1,), dof="z"), [fixture]
    )
    assert not says(effect("grounding_spring", nodes=(2,), dof="ry"), [fixture])
    along = effect(FIXTURE, count=2, nodes=(1,), dof="z")
    assert not says(spring, [along]), "it acts along another axis"


def test_two_supports_of_which_one_is_made_rigid_again_may_be_the_other() -> None:
    both = effect("grounding_spring", nodes=(1, 2), dof="rz")
    one, two = (effect("grounding_spring", nodes=(n,), dof="rz") for n in (1, 2))
    assert says(two, [both, one]) and says(one, [two, both])
    assert not says(one, [both, one]), "the one that is rigid again"
    assert not says(two, [both, effect("grounding_spring", nodes=(1,), dof="x")])
    joints = effect("joint_flexibility", nodes=(1, 2), elements=(3, 4), dof="rz")
    loose = effect("joint_flexibility", nodes=(1,), elements=(3,), dof="rz")
    still = effect("joint_flexibility", nodes=(2,), elements=(4,), dof="rz")
    assert not says(still, [joints, loose]), "a joint's own compliance adds to its class's"


def test_more_of_the_same_kind_covers() -> None:
    assert covers(softer(8, 9), softer(8)) and not covers(softer(8), softer(8, 9))
    assert not covers(effect("mass_change", elements=(8, 9)), softer(8))


def test_where_a_fixture_stands_no_lump_and_no_spring_is_sought() -> None:
    """They are its mass and its springs; elsewhere they are, and everything else there is."""
    lump, spring = (effect(n, nodes=(1,), dof="z") for n in ("added_mass", "grounding_spring"))
    damper, other = effect("viscous_damper", nodes=(1,), dof="z"), effect("added_mass", nodes=(2,))
    fixture = effect(FIXTURE, count=4, nodes=(1,))
    known = [lump, spring, damper, other, fixture]
    parent = supposed(PlainFit(1.0), fixture)
    assert further(known, parent) == [damper, other]
    assert further(known, Hypothesis((), parent.fit)) == known
