"""Worker processes of the validation scripts, from the standard library."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager


@contextmanager
def workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of ``jobs`` fresh processes. An exception or Ctrl-C in the block ends them at once: a
    case takes minutes, and nobody waits for it."""
    context = multiprocessing.get_context("spawn")  # no BLAS threads inherited half-way
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=_quiet) as pool:
        before = {p.pid for p in multiprocessing.active_children()}
        try:
            yield pool
        except BaseException:
            for child in multiprocessing.active_children():
                if child.pid not in before:
                    child.terminate()
            pool.shutdown(cancel_futures=True)
            raise


def _quiet() -> None:
    """Ctrl-C goes to every process of the terminal; the one that holds the pool ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
