"""Compilation of the loops over time.

A step of a nonlinear structure is a few hundred multiplications on arrays that are too small for
numpy, whose calls cost more than the work: compiled by numba the same loop is some hundred times
faster (`tests/benchmarks/test_simulate.py`). What is compiled stays plain Python, so that it can be
read, and run in a debugger with NUMBA_DISABLE_JIT=1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """``function`` compiled on its first call for the types it is called with, real or complex; the
    machine code is kept beside the module, until that module changes: what calls the laws of
    `scalar` in another module keeps them as they were there."""
    return cast(Function, numba.njit(cache=True, fastmath={"reassoc", "contract"})(function))
