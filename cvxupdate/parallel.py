"""Independent tasks on processes of this machine, or on a dask cluster that is already there.

Either way a worker opens what all tasks need once and solves one task after the other, results come
as they are finished, and a task knows nothing of the others: whoever writes results down as they
come can go on after an interruption.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from cvxupdate.errors import CvxupdateError, InputError

Solve = Callable[..., Any]
Open = Callable[..., Solve]
TIMEOUT = 20.0  # s until a scheduler counts as not there
JOBS = "CVXUPDATE_JOBS"
"""Environment variable: processes where nothing else says how many (tests and validation have as
many processes as there are processors already)."""


def processors() -> int:
    """How many processes work at a time unless something else is asked for: one for each processor
    that this process may use, or what the environment says."""
    asked = os.environ.get(JOBS, "")
    return int(asked) if asked.isdecimal() and int(asked) > 0 else available()


def available() -> int:
    """How many processors this process may use."""
    if sys.platform.startswith("linux"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class Where:
    """Where tasks run: in ``jobs`` processes of this machine (None: as many as there are
    processors; 1: in this one), or on the dask cluster whose ``scheduler`` has that address."""

    jobs: int | None = None
    scheduler: str | None = None


def spread(
    tasks: Sequence[tuple[Any, ...]], open_: Open, arguments: Mapping[str, Any], where: Where
) -> Iterator[Any]:
    """``open_(**arguments)(*task)`` of every task, in the order in which they are finished.

    ``open_`` and the arguments must be such that another process can import or rebuild them. On a
    cluster tasks of a worker that is lost are done again on another one.

    Raises
    ------
    InputError
        Without the extra ``parallel``, or where no scheduler answers.
    CvxupdateError
        When the cluster is lost on the way.
    """
    if not tasks:
        return iter(())
    if where.scheduler is not None:
        return _on_cluster(tasks, open_, arguments, where.scheduler)
    jobs = min(len(tasks), processors() if where.jobs is None else where.jobs)
    return (_here if jobs <= 1 else _on_processes)(tasks, open_, arguments, jobs)


def _here(
    tasks: Sequence[tuple[Any, ...]], open_: Open, arguments: Mapping[str, Any], jobs: int
) -> Iterator[Any]:
    solve = open_(**arguments)
    for task in tasks:
        yield solve(*task)


def _on_processes(
    tasks: Sequence[tuple[Any, ...]], open_: Open, arguments: Mapping[str, Any], jobs: int
) -> Iterator[Any]:
    context = multiprocessing.get_context("spawn")  # no threads of BLAS inherited half-way
    begin, before = (open_, dict(arguments)), {p.pid for p in multiprocessing.active_children()}
    with ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=begin) as pool:
        futures = [pool.submit(_one, task) for task in tasks]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            # a task may take minutes, and nobody waits for it any more
            for child in multiprocessing.active_children():
                if child.pid not in before:
                    child.terminate()
            pool.shutdown(cancel_futures=True)
            raise


_WORKER: dict[str, Solve] = {}


def _begin(open_: Open, arguments: dict[str, Any]) -> None:
    """Ctrl-C goes to every process of the terminal; the one that holds the pool ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _WORKER["solve"] = open_(**arguments)


def _one(task: tuple[Any, ...]) -> Any:
    return _WORKER["solve"](*task)


def _on_cluster(
    tasks: Sequence[tuple[Any, ...]], open_: Open, arguments: Mapping[str, Any], scheduler: str
) -> Iterator[Any]:
    with _client(scheduler) as client:
        from distributed import KilledWorker
        from distributed import as_completed as finished
        from distributed.comm import CommClosedError

        run = uuid.uuid4().hex
        futures = [
            client.submit(_remote, run, open_, dict(arguments), task, key=f"cvxupdate-{run}-{i}")
            for i, task in enumerate(tasks)
        ]
        try:
            for future in finished(futures, loop=client.loop):
                yield future.result()
                future.release()
        except KilledWorker as error:
            raise CvxupdateError(
                f"{scheduler}: one task ended every worker that took it ({error.task}): they ran "
                "out of memory, or were stopped. What was finished is kept; give the workers more "
                "memory and start again."
            ) from error
        except (CommClosedError, TimeoutError, OSError) as error:
            raise CvxupdateError(
                f"{scheduler}: the cluster was lost on the way ({error}). What was finished is "
                "kept; start the cluster and the same command again."
            ) from error
        finally:
            client.cancel(futures)


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    """A client of the scheduler at that address."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            f"--scheduler {scheduler}: a dask cluster is reached with the extra `parallel`. "
            "Install it (pip install 'cvxupdate[parallel]'), or leave the option out: processes "
            "of this machine are used then."
        ) from None
    client = Client.__new__(Client)
    try:
        client.__init__(scheduler, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        # Else its thread is ended when it happens to be collected; while another client begins,
        # that waits for a lock which this thread holds itself (distributed 2026.8).
        client.__del__()
        raise InputError(
            f"--scheduler {scheduler}: no dask scheduler answers there ({error}). Give its "
            "address as it prints it when it starts, such as tcp://192.168.0.7:8786."
        ) from error
    try:
        yield client
    finally:
        client.close()


_OWN = threading.local()
"""Of a thread of a worker of dask: the run that it works for, and what solves its tasks."""


def _remote(run: str, open_: Open, arguments: dict[str, Any], task: tuple[Any, ...]) -> Any:
    if getattr(_OWN, "run", None) != run:
        _OWN.solve = open_(**arguments)
        _OWN.run = run
    return _OWN.solve(*task)
