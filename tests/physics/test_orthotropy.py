"""When four rigidities are those of one factor."""

from __future__ import annotations

import pytest

from cvxupdate.physics.orthotropy import ALIKE, RIGIDITIES, Orthotropy


def figures(*values: float) -> dict[str, float]:
    return dict(zip(RIGIDITIES, values, strict=True))


def test_one_factor_is_a_change_of_stiffness() -> None:
    """As far as the deviations tell: rigidities of 0.69 to 0.71 may all be 0.71."""
    found, std = figures(0.713, 0.714, 0.709, 0.688), figures(0.019, 0.020, 0.032, 0.019)
    assert Orthotropy().plainly(found, std)
    assert not Orthotropy().plainly(found, {n: s / 5.0 for n, s in std.items()})


@pytest.mark.parametrize("which", RIGIDITIES)
def test_one_rigidity_that_differs_is_a_direction(which: str) -> None:
    std = figures(0.01, 0.01, 0.01, 0.01)
    for times, alike in ((0.9, True), (2.0, False)):
        # of four with like deviations the common factor is a quarter of the way
        found = figures(1.0, 1.0, 1.0, 1.0) | {which: 1.0 + times * ALIKE * 0.01 / 0.75}
        assert Orthotropy().plainly(found, std) == alike
