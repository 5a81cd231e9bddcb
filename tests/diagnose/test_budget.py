"""What a diagnosis may take, and that it says so."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from cvxupdate.diagnose import budget
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.pipeline import diagnosed
from cvxupdate.diagnose.settings import BUDGET, CUT_SHORT, SHARED, WALL
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from tests.cases.cantilever import load, rows_of, text


@pytest.fixture(autouse=True)
def usual(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time that users have, not that of tests."""
    monkeypatch.setattr(budget, "BUDGET", BUDGET)
    monkeypatch.setattr(budget, "WALL", WALL)


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
    assert ample.says == "at most about 2 minutes on a machine of its own"
    waited = Budget(computing=1e9, clock=0.01)
    time.sleep(0.02)
    assert waited.over()
    busy = Budget(computing=0.0, clock=1e9)
    sum(range(200_000))
    assert busy.over(), "the time of this thread"
    elsewhere = Budget(computing=0.2, clock=1e9)
    other = threading.Thread(target=lambda: [sum(range(200_000)) for _ in range(100)])
    other.start()
    other.join()
    assert not elsewhere.over(), "what other threads compute is theirs"
    assert busy.over() and "--thorough" in busy.lines[0]


def test_several_processes_compute_more_in_the_same_time() -> None:
    alone, two = Budget.of(False, 1), Budget.of(False, 2)
    assert alone.computing == BUDGET and two.computing == pytest.approx(SHARED * BUDGET)
    assert (two.clock, two.says) == (alone.clock, alone.says)
    assert Budget.of(True, 2).computing == float("inf")


def test_what_the_compiler_does_takes_nothing_from_it() -> None:
    """The first simulation after an installation makes its machine code, a quarter of a minute of
    the two that a diagnosis had."""
    budget = Budget(computing=0.05, clock=0.05)
    with budget.aside():
        time.sleep(0.06)
        begin = time.thread_time()
        while time.thread_time() - begin < 0.06:
            pass
    assert not budget.over()


def test_once_over_it_stays_so_and_only_asking_counts() -> None:
    """A search that ended before its time left nothing undone."""
    budget = Budget(computing=1e9, clock=0.0)
    time.sleep(0.001)
    assert budget.lines == []
    assert budget.over() and budget.stopped


def test_what_is_left_undone_is_said_once_over() -> None:
    budget = Budget(computing=1e9, clock=0.0)
    budget.leave("explanations", 3)
    budget.leave("explanations", 2)
    budget.leave("pairs of effects")
    budget.leave("short lists", 1)
    assert budget.lines == []
    time.sleep(0.001)
    assert budget.over()
    assert (
        "Not tried: 5 explanations; pairs of effects; one of the short lists. " in budget.lines[0]
    )


def test_half_of_the_time_begins_when_it_is_taken() -> None:
    whole = Budget(computing=10.0, clock=0.04)
    time.sleep(0.03)
    half = whole.part(0.5)
    assert half.computing == 5.0 and half.clock == 0.02 and not half.over()
    rest = whole.rest(0.5)
    assert rest.computing == 5.0 and rest.clock <= 0.01, "no more than is left"
    assert Budget.of(True).rest(0.5).computing == float("inf")


def test_thorough_is_never_over() -> None:
    thorough = Budget.of(True)
    assert not thorough.over() and "thorough" in thorough.says and thorough.lines == []
    assert Budget.of(False).clock == WALL


def test_tables_of_modes_end_with_the_time_and_say_so(tmp_path: Path) -> None:
    """The best of what was refitted is the answer, and never sure."""
    lump = '[[model.elements]]\ntype = "mass"\nrows = [{ id = 90, nodes = [9], m = 0.2 }]'
    _, real = load(tmp_path, text(extra=lump))
    spec, model = load(tmp_path, text(rows_of(model_modes(real, 6).frequencies[:6])))
    recordings = load_recordings(spec)
    said: list[str] = []
    evidence = gathered(spec, model, recordings, said.append, budget=Budget(0.0, 0.0))
    found = diagnosed(spec, recordings, evidence, said.append, time.perf_counter())
    assert all(f.confidence <= CUT_SHORT for f in found.findings)
    (ended,) = (line for line in found.evidence if "ended the search" in line)
    assert "explanations fitted for the first time" in ended and "--thorough" in ended
    assert sum(line.startswith("refitting") for line in said) == 1
