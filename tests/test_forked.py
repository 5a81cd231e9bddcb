"""Tasks done ahead by forked children: the same results in the same order however many there are,
errors as themselves, and nothing left of a child that is lost or not waited for."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cvxupdate import forked
from cvxupdate.blas import _pools, one_thread
from cvxupdate.errors import CvxupdateError, Fault, InfeasibleError, ModelError, ProblemFileError
from cvxupdate.forked import Ahead, every, may_fork, processor_time
from cvxupdate.inherited import Inherited
from cvxupdate.parallel import JOBS, processors

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="children are for Linux")


@pytest.fixture(autouse=True)
def room(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if alone on a machine with processors enough; workers of the tests hear from a thread of
    their own what to do."""
    monkeypatch.setattr(forked, "available", lambda: 8)
    monkeypatch.setattr(threading, "enumerate", lambda: [threading.current_thread()])


@pytest.fixture(autouse=True)
def none_left() -> Iterator[None]:
    """No zombie, no child, no open pipe."""
    before = set(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else set()
    yield
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)
    if before:
        assert set(os.listdir("/proc/self/fd")) <= before


def busy(seconds: float) -> None:
    begin = time.thread_time()
    while time.thread_time() - begin < seconds:
        pass


@linux
@pytest.mark.parametrize("jobs", [2, 3, 8])
def test_results_come_in_their_order_whoever_works(jobs: int) -> None:
    def work(k: int) -> tuple[int, int, np.ndarray]:
        busy(0.001 * (k % 3))
        return k, os.getpid(), np.full(20_000, float(k))  # a pipe would hold none of these

    found = every(work, range(12), jobs)
    assert [k for k, _, _ in found] == list(range(12))
    assert all((v == k).all() for k, _, v in found)
    assert len({pid for _, pid, _ in found}) <= jobs


@linux
def test_this_process_works_along() -> None:
    """Two tasks of which each waits for the other to begin."""
    ends = [os.pipe(), os.pipe()]

    def work(k: int) -> tuple[bool, int]:
        os.write(ends[k][1], b"!")
        there, _, _ = select.select([ends[1 - k][0]], [], [], 60.0)
        return bool(there), os.getpid()

    found = every(work, range(2), 2)
    for end in ends:
        os.close(end[0])
        os.close(end[1])
    assert all(there for there, _ in found)
    assert os.getpid() in {pid for _, pid in found} and len({pid for _, pid in found}) == 2


def test_one_process_is_this_one_and_nothing_is_done_ahead() -> None:
    done: list[int] = []
    with Ahead(done.append, range(5), 1) as ahead:
        ahead.take()
        assert done == [0]
    assert every(os.getpid, [], 4) == []
    assert every(lambda _: os.getpid(), [1], 4) == [os.getpid()]


@linux
def test_errors_of_a_task_come_at_its_turn_as_themselves() -> None:
    faults = (Fault("a.toml", "model", "is empty.", "Give nodes."),) * 2
    raised = {
        1: ModelError("no structure"),
        3: InfeasibleError("no room", ("bounds",)),
        4: ProblemFileError(faults),
    }

    def work(k: int) -> int:
        busy(0.01)
        if k in raised:
            raise raised[k]
        return k

    with Ahead(work, range(6), 2) as ahead:
        assert ahead.take() == 0
        with pytest.raises(ModelError, match=r"^no structure$"):
            ahead.take()
        assert ahead.take() == 2
        with pytest.raises(InfeasibleError) as infeasible:
            ahead.take()
        assert infeasible.value.conflict == ("bounds",)
        with pytest.raises(ProblemFileError) as fault:
            ahead.take()
        assert fault.value.faults == faults and str(fault.value) == str(raised[4])
        assert ahead.take() == 5


@linux
def test_an_error_of_the_program_itself_says_where_it_happened() -> None:
    own = os.getpid()

    def work(k: int) -> int:
        if os.getpid() != own:
            return [][k]
        time.sleep(0.2)
        return k

    with pytest.raises(IndexError) as error:
        every(work, range(10), 2)
    assert "return [][k]" in error.value.__notes__[0]


@linux
@pytest.mark.parametrize(
    ("how", "says"),
    [
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "ended by signal 9"),
        (lambda: os._exit(3), "ended with status 3"),
    ],
)
def test_a_child_that_is_lost_is_one_clear_error(how: Any, says: str) -> None:
    own = os.getpid()

    def work(k: int) -> None:
        if os.getpid() != own:
            how()
        time.sleep(0.2)

    with pytest.raises(CvxupdateError, match=rf"{says}.*--jobs 1"):
        every(work, range(10), 2)


@linux
def test_ctrl_c_ends_children_at_once() -> None:
    own, begin = os.getpid(), time.perf_counter()

    def work(k: int) -> None:
        if os.getpid() == own:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(600.0)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:  # a background job inherits "ignored", and would sleep for ever
        with pytest.raises(KeyboardInterrupt):
            every(work, range(4), 3)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.perf_counter() - begin < 60.0


@linux
def test_ctrl_c_is_not_for_a_child() -> None:
    """A terminal sends it to every process; the one that holds the children ends them."""
    own = os.getpid()

    def work(k: int) -> int:
        if os.getpid() != own:
            os.kill(os.getpid(), signal.SIGINT)
        else:
            time.sleep(0.1)
        return k

    assert every(work, range(4), 2) == [0, 1, 2, 3]


@linux
def test_what_nobody_takes_is_not_waited_for() -> None:
    own, begin = os.getpid(), time.perf_counter()
    with Ahead(lambda k: time.sleep(600.0 * (k and os.getpid() != own)), range(9), 3) as ahead:
        ahead.take()
    assert time.perf_counter() - begin < 60.0


@linux
def test_processor_time_of_children_counts() -> None:
    """Whoever does the work, so much is used; what they did for nobody does not count."""
    begin = processor_time()
    every(lambda k: busy(0.05), range(6), 3)
    assert 0.3 <= processor_time() - begin < 0.6


@linux
def test_a_child_does_not_fork_and_knows_what_was_used() -> None:
    own, before = os.getpid(), processor_time()

    def work(k: int) -> tuple[bool, bool, float]:
        time.sleep(0.05)
        return os.getpid() != own, may_fork(), processor_time()

    for child, may, used in every(work, range(4), 2):
        assert may is not child
        assert before <= used < before + 5.0


@linux
def test_warnings_of_children_are_heard_here() -> None:
    own = os.getpid()

    def work(k: int) -> None:
        time.sleep(0.05)
        if os.getpid() != own:
            warnings.warn("odd", UserWarning, stacklevel=1)

    with pytest.warns(UserWarning, match="odd"):
        every(work, range(20), 2)


@dataclass(frozen=True)
class Held:
    """What cannot be sent, and what is large."""

    call: Any
    large: np.ndarray


Held.__module__ = "cvxupdate.somewhere"


@linux
def test_what_was_there_before_comes_back_as_itself() -> None:
    held = Held(lambda: 1, np.zeros(10))
    own = os.getpid()

    def work(k: int) -> tuple[Held, np.ndarray, Any, int]:
        time.sleep(0.02)
        return held, held.large, held.call, os.getpid()

    found = every(work, range(8), 2)
    assert all(a is held and b is held.large and c is held.call for a, b, c, _ in found)
    assert {pid for *_, pid in found} != {own}


@linux
def test_functions_that_a_task_makes_come_back() -> None:
    """As effects bring them: with what they hold, which may be functions too."""

    def work(k: int) -> Any:
        time.sleep(0.02)
        times = lambda x: k * x  # noqa: E731
        pid = os.getpid()

        def made(x: int, plus: int = 1, *, more: int = 2) -> tuple[int, int]:
            return times(x) + plus + more, pid

        return made

    found = [made(10) for made in every(work, range(8), 2)]
    assert [value for value, _ in found] == [10 * k + 3 for k in range(8)]
    assert {pid for _, pid in found} != {os.getpid()}


@linux
def test_what_cannot_be_sent_is_done_here() -> None:
    def work(k: int) -> Any:
        time.sleep(0.02)
        return threading.Lock(), os.getpid()

    assert {pid for _, pid in every(work, range(4), 2)} == {os.getpid()}


def test_only_what_both_had_is_sent_by_number() -> None:
    old = np.arange(1000.0)
    shared = Inherited([(old, {"a": [old]})])
    sent = shared.packed([old, old + 1.0, "a"])
    found = shared.unpacked(sent)
    assert found[0] is old and (found[1] == old + 1.0).all() and found[2] == "a"
    assert len(sent) < 9000


def test_nobody_forks_where_a_child_could_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    assert may_fork() is sys.platform.startswith("linux")
    current = threading.current_thread()
    monkeypatch.setattr(threading, "enumerate", lambda: [current, threading.Thread()])
    assert not may_fork()
    monkeypatch.setattr(threading, "enumerate", lambda: [current, Drawing()])
    assert may_fork() is sys.platform.startswith("linux")
    monkeypatch.setattr(forked, "available", lambda: 1)
    assert not may_fork()
    monkeypatch.setattr(forked, "available", lambda: 8)
    monkeypatch.setattr("multiprocessing.parent_process", lambda: object())
    assert not may_fork()


class Drawing(threading.Thread):
    """What draws a line of progress meanwhile."""


Drawing.__module__ = "rich.live"


def test_the_environment_says_how_many(monkeypatch: pytest.MonkeyPatch) -> None:
    assert processors() == 1, "inside the tests"
    monkeypatch.setenv(JOBS, "3")
    assert processors() == 3
    for nothing in ("", "0", "many"):
        monkeypatch.setenv(JOBS, nothing)
        assert processors() >= 1


def test_linear_algebra_takes_one_thread() -> None:
    np.ones((2, 2)) @ np.ones((2, 2))
    had = [get() for get, _ in _pools()]
    for _, set_ in _pools():
        set_(2)
    asked = [get() for get, _ in _pools()]  # a library may give fewer
    with one_thread():
        assert all(get() == 1 for get, _ in _pools())
    assert [get() for get, _ in _pools()] == asked
    for (_, set_), count in zip(_pools(), had, strict=True):
        set_(count)
