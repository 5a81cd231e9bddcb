"""What a diagnosis may take, and that it says so."""

from __future__ import annotations

import time

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.settings import BUDGET, WALL


def test_time_by_the_clock_counts_as_well() -> None:
    ample = Budget()
    assert (
        not ample.over()
        and ample.lines == []
        and (ample.computing, ample.clock)
        == (
            BUDGET,
            WALL,
        )
    )
    assert ample.says == "at most about 2 minutes"
    waited = Budget(computing=1e9, clock=0.01)
    time.sleep(0.02)
    assert waited.over()
    busy = Budget(computing=0.0, clock=1e9)
    sum(range(200_000))
    assert busy.over() and "--thorough" in busy.lines[0]


def test_once_over_it_stays_so_and_only_asking_counts() -> None:
    """A search that ended before its time left nothing undone."""
    budget = Budget(computing=1e9, clock=0.0)
    time.sleep(0.001)
    assert budget.lines == []
    assert budget.over() and budget.stopped


def test_thorough_is_never_over() -> None:
    thorough = Budget.of(True)
    assert not thorough.over() and "thorough" in thorough.says and thorough.lines == []
    assert Budget.of(False).clock == WALL
