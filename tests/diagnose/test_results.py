"""What a finding says of its size."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cvxupdate.diagnose.results import Finding
from cvxupdate.physics.quantity import physical, stiffness
from tests.cases.plain_evidence import effect

SPRING = stiffness("k", "N·m/rad", 1e-6)


@pytest.mark.parametrize(
    ("figure", "k", "deviation", "says"),
    [
        pytest.param(SPRING, 31.0, 150.0, "less than 331 N·m/rad", id="a hinge, nearly"),
        pytest.param(SPRING, 31.0, 3.0, "", id="soft, and told how soft"),
        pytest.param(physical("k", "N/m"), 31.0, 150.0, "", id="a spring that may be none"),
    ],
)
def test_a_spring_that_may_be_as_good_as_free_says_so(figure, k, deviation, says):
    """31 ± 150 N·m/rad is no size: what it leaves of a clamp goes with its stiffness."""
    loose = replace(effect("joint_flexibility"), figures=(figure,))
    found = Finding.of(loose, {"k": k}, {"k": deviation}, 0.9)
    assert ("as good as free" in found.says) == bool(says) and says in found.says
