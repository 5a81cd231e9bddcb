"""Changes of stiffness that contradict or repeat one another."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cvxupdate.diagnose.judge import jumble
from cvxupdate.diagnose.judge.jumble import jumbled
from cvxupdate.physics.chains import Chain
from tests.cases.plain_evidence import PlainFit, effect

LINE = Chain(tuple(range(1, 9)), tuple(range(1, 10)), (0.1,) * 8)


@pytest.fixture(autouse=True)
def line(monkeypatch):
    monkeypatch.setattr(jumble, "chains", lambda model: [LINE])


def softer(*elements: int, groups=()):
    return effect("stiffness_change", elements=elements, groups=groups)


def joint(element: int, node: int):
    return effect("joint_flexibility", elements=(element,), nodes=(node,), dof="ry")


def of(*pairs):
    """A hypothesis of effects with their first unknowns."""
    effects, sizes = tuple(e for e, _ in pairs), [s for _, s in pairs]
    return SimpleNamespace(effects=effects, fit=PlainFit(1.0), sizes=lambda k: [sizes[k]])


def test_elements_that_are_softer_twice_or_softer_and_stiffer() -> None:
    assert jumbled(of((softer(6, 7, 8), -0.3), (softer(7, 8), -0.1)), None)
    assert jumbled(of((softer(6, 7, 8), -0.3), (softer(6), 0.2)), None)
    assert jumbled(of((softer(6, 7), -0.3), (softer(8), 0.2)), None), "side by side"


def test_not_what_one_may_believe() -> None:
    assert not jumbled(of((softer(2), -0.3), (softer(6), 0.2)), None)
    assert not jumbled(of((softer(2), -0.3), (softer(3), -0.2)), None)
    assert not jumbled(of((softer(*range(1, 9), groups=("a",)), 0.1), (softer(6), -0.2)), None)
    assert not jumbled(of((softer(6), -0.3), (effect("added_mass", nodes=(7,)), 0.2)), None)


def test_joints_of_one_element_after_the_other_are_no_joints() -> None:
    assert jumbled(of((joint(3, 4), 0.3), (joint(4, 5), 0.2)), None)
    assert jumbled(of((joint(3, 4), 0.3), (softer(5), -0.2)), None)
    assert not jumbled(of((joint(1, 1), 0.3), (joint(8, 9), 0.2)), None), "ends of the member"
    assert not jumbled(of((joint(1, 2), 0.3), (joint(6, 7), 0.2)), None), "far apart"
