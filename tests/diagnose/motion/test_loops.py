"""Loops of a part with friction and play, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.motion.component import Law, laws_of
from cvxupdate.diagnose.motion.loops import travels
from tests.diagnose.motion.test_component import FORCE, PLAY, K, rig

EXACT = PLAY + 1.5 * FORCE / K  # spring lets go, play, spring bent by half


def test_travel_after_a_reversal_is_that_of_spring_and_play() -> None:
    run = rig("fit", 0.5)
    best = min(laws_of([run]), key=lambda law: law.errors[0])
    found = travels(run, best)
    # five seconds at half a cycle a second: five turns, the last of which may come too late
    assert len(found) in (4, 5)
    assert np.median(found) == pytest.approx(EXACT, rel=0.03)


def test_a_law_with_a_wrong_play_says_the_same_of_the_loops() -> None:
    run = rig("fit", 0.5)
    off = Law("jenkins with play", (FORCE / K, 1.4 * PLAY), ((0.0, 0.0, 0.0, FORCE),), (0.1, 0.1))
    assert abs(off.travel / EXACT - 1.0) > 0.2
    assert np.median(travels(run, off)) == pytest.approx(EXACT, rel=0.03)


def test_motion_that_does_not_turn_says_nothing() -> None:
    run = rig("fit", 0.5)
    law = Law("jenkins", (FORCE / K, 0.0), ((0.0, 0.0, 0.0, 0.0),), (0.1, 0.1))
    assert len(travels(run, law)) == 0
