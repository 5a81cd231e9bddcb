"""Tasks on processes and on a dask cluster: the same results, also where a worker is lost half-way,
and clear words where there is no cluster."""

from __future__ import annotations

import builtins
import gc
import importlib.util
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.parallel import Where, spread
from cvxupdate.update.starts import Kept, StartEnd, run_starts

installed = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="needs the extra `parallel` (dask)"
)
TASKS = [(k, np.array([0.5, float(k)])) for k in range(6)]
LOST = 3  # the task whose worker ends


def solving(lost: str = "") -> Callable[[int, np.ndarray], StartEnd]:
    """What solves a start; the first time that the task `LOST` comes its process ends, where a file
    ``lost`` is named to remember that."""

    def solve(number: int, p: np.ndarray) -> StartEnd:
        if lost and number == LOST and not Path(lost).exists():
            Path(lost).write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        return StartEnd(number, float(p @ p), tuple(p.tolist()), "converged", 1, 0.0)

    return solve


def slow() -> Callable[[float], float]:
    return lambda seconds: time.sleep(seconds) or seconds


def refused(reason: str) -> Callable[[int], int]:
    raise InputError(reason)


ALONE = tuple(solving()(*task) for task in TASKS)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as found:
        yield found


@installed
def test_a_worker_that_is_lost_costs_nothing_but_time(cluster: Any, tmp_path: Path) -> None:
    """Every task is solved and written down once, and what is there is not asked for again."""
    kept, lost = Kept(tmp_path / "starts.jsonl", "mark"), tmp_path / "lost"
    kept.add(ALONE[1])
    where = Where(scheduler=cluster.scheduler_address)
    said: list[tuple[int, int]] = []
    ends = run_starts(TASKS, solving, {"lost": str(lost)}, kept, where, lambda *n: said.append(n))
    assert lost.exists()  # a process ended at it
    assert ends == ALONE
    assert said == [(k, 6) for k in range(2, 7)]
    assert kept.read() == {e.number: e for e in ALONE}
    assert len(kept.file.read_text().splitlines()) == 6  # type: ignore[union-attr]


@installed
def test_what_cannot_be_opened_says_why(cluster: Any) -> None:
    where = Where(scheduler=cluster.scheduler_address)
    with pytest.raises(InputError, match="no such file"):
        list(spread([(1,)], refused, {"reason": "no such file"}, where))


@installed
@pytest.mark.parametrize("address", ["nowhere", "tcp://127.0.0.1:9"])
def test_a_scheduler_that_is_not_there(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Said, and nothing is left behind: a client that did not begin, and is collected while
    another one begins, waits for ever."""
    monkeypatch.setattr("cvxupdate.parallel.TIMEOUT", 0.5)
    gc.disable()
    try:
        with pytest.raises(InputError, match=f"--scheduler {address}: no dask scheduler answers"):
            list(spread(TASKS, solving, {}, Where(scheduler=address)))
        left = {o.status for o in gc.get_objects() if type(o).__name__ == "Client"}
        assert left <= {"closed"}
    finally:
        gc.enable()


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = builtins.__import__

    def absent(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == "distributed":
            raise ImportError(name)
        return plain(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(InputError, match=r"extra `parallel`.*pip install 'cvxupdate\[parallel\]'"):
        list(spread(TASKS, solving, {}, Where(scheduler="tcp://127.0.0.1:9")))


def test_one_process_is_this_one() -> None:
    assert list(spread([(1,)], lambda: lambda k: (k, os.getpid()), {}, Where(1))) == [
        (1, os.getpid())
    ]
    assert not list(spread([], refused, {"reason": "never"}, Where(2)))


def test_an_interruption_ends_tasks_that_are_under_way() -> None:
    begin, before = time.perf_counter(), multiprocessing.active_children()
    results = spread([(0.0,), (600.0,)], slow, {}, Where(2))
    assert next(results) == 0.0
    with pytest.raises(KeyboardInterrupt):
        results.throw(KeyboardInterrupt)  # type: ignore[attr-defined]
    assert time.perf_counter() - begin < 60.0
    assert set(multiprocessing.active_children()) <= set(before)
