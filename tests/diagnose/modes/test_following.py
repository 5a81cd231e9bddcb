"""Modes are followed as by full solutions at every step."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.modes.setting import setting_of
from cvxupdate.residual.following import STEPS, _nearly


@pytest.mark.parametrize("name", ["grounding_spring", "added_mass", "joint_flexibility"])
def test_modes_are_followed_far_in_the_space_of_both_ends(tried, name):
    """As by full solutions at every step, wherever the effect stands and though modes cross on the
    way."""
    evidence, base, candidates = tried
    some = [c for c in candidates if c.physics == name and c.change is not None][::4]
    crossed = 0
    for c in some:
        residual = setting_of(c.change.model, evidence.tables, base.point.residual).residual
        start = np.append(np.zeros(len(base.point.p)), 0.9 * c.limits[1])
        point = None
        for size in np.geomspace(1e-4, 1.0, STEPS):
            point = residual.evaluate(size * start, point)
        short = residual.evaluate(start, _nearly(residual, residual.evaluate(start)))
        assert all(np.array_equal(a, b) for a, b in zip(short.places, point.places, strict=True)), (
            c.name
        )
        crossed += any(
            not np.array_equal(a, b)
            for a, b in zip(point.places, residual.start.places, strict=True)
        )
    assert crossed or name != "grounding_spring"
