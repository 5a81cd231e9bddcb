"""How many threads linear algebra takes: one, where several processes work.

Matrices are small here and threads wait for each other, so that two processes with two threads each
are slower than with one. The figures also stay the same to the last bit, whatever the machine.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

MAPS = Path("/proc/self/maps")  # what this process has loaded
# of builds that numpy and scipy bring along, and of those that a system has
PREFIXES, SUFFIXES = ("scipy_openblas_", "openblas_"), ("64_", "_64", "")

Pool = tuple[Callable[[], int], Callable[[int], None]]


@contextmanager
def one_thread() -> Iterator[None]:
    """Within it OpenBLAS, as far as it is loaded, computes in the thread that asks."""
    had = [(set_, get()) for get, set_ in _pools()]
    several = [(set_, count) for set_, count in had if count > 1]
    for set_, _ in several:
        set_(1)
    try:
        yield
    finally:
        for set_, count in several:
            set_(count)


@cache
def _pools() -> tuple[Pool, ...]:
    """What asks for the number of threads and what sets it, of each library."""
    if not sys.platform.startswith("linux"):
        return ()
    rows = [line.split(maxsplit=5) for line in MAPS.read_text(encoding="utf-8").splitlines()]
    files = dict.fromkeys(r[5] for r in rows if len(r) > 5 and "openblas" in r[5].lower())
    return tuple(pool for file in files for pool in _pools_of(file))


def _pools_of(file: str) -> list[Pool]:
    try:
        library = ctypes.CDLL(file)
    except OSError:
        return []
    for prefix in PREFIXES:
        for suffix in SUFFIXES:
            names = [f"{prefix}{verb}_num_threads{suffix}" for verb in ("get", "set")]
            get, set_ = (getattr(library, name, None) for name in names)
            if get is not None and set_ is not None:
                return [(get, set_)]
    return []
