"""What a solver is to the rest of the room: a name, the cones it takes, and one function."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...system import Array
from ..certificate import Certificate
from ..matrix_form import ConeProgram

CONE_WORDS = {"soc": "second-order cone", "psd": "semidefinite cone", "exp": "exponential cone"}


@dataclass(frozen=True)
class SolverChoice:
    """Which solver, and how hard it shall try.

    ``tolerance`` is the relative accuracy asked of it; ``max_iterations`` None takes the adapter's
    default; ``polish`` refines a quadratic program's solution on its active set (OSQP by itself,
    any solver where the certificate is poor). ``direct``: least squares within bounds alone are
    minimised by an active set first, and by the solver where that cannot be proved.
    """

    name: str = "CLARABEL"
    tolerance: float = 1e-9
    max_iterations: int | None = None
    polish: bool = True
    direct: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1:
            raise InputError(
                f"solver {self.name}: tolerance {self.tolerance} must lie between 0 and 1; "
                "1e-9 is customary."
            )
        if self.max_iterations is not None and self.max_iterations < 1:
            raise InputError(
                f"solver {self.name}: max_iterations {self.max_iterations} must be 1 or more."
            )


@dataclass(frozen=True, eq=False)
class RawSolution:
    """What a solver returned: ``x`` (variables,), ``z`` (rows,), ``s`` (rows,); ``status`` optimal,
    infeasible, stopped, or refused (the solver cannot take such a program; ``note`` says why).

    With "infeasible" ``z`` is the solver's proof of it, NaN when it gives none; ``note`` is the
    solver's own word. ``certificate`` is `certify` of the program at (x, s, z) where the adapter
    has looked already, None where it has not.
    """

    x: Array
    z: Array
    s: Array
    status: str
    seconds: float
    iterations: int = 0
    note: str = ""
    certificate: Certificate | None = None


@dataclass(frozen=True)
class Solver:
    """A solver: its name, the cones that it takes beyond linear ones, and ``solve(program,
    choice)``."""

    name: str
    cones: frozenset[str]
    solve: Callable[[ConeProgram, SolverChoice], RawSolution]

    def refusal(self, program: ConeProgram) -> str:
        """Why the solver cannot take the program, in words; empty when it can."""
        missing = sorted(program.cones.beyond_qp - self.cones)
        return (
            f"{self.name} cannot take the {' and the '.join(CONE_WORDS[kind] for kind in missing)}"
            if missing
            else ""
        )


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Nothing that compiled code prints reaches standard output, where results are: HiGHS prints a
    banner before any option can forbid it."""
    try:
        sys.stdout.flush()
        kept = os.dup(1)
    except (AttributeError, OSError):  # no standard output
        yield
        return
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def no_solution(
    program: ConeProgram, status: str, seconds: float, note: str, z: Array | None = None
) -> RawSolution:
    """An answer without a point."""
    nothing = np.full(program.q.size, np.nan)
    rows = np.full(program.b.size, np.nan)
    return RawSolution(nothing, rows if z is None else z, rows, status, seconds, 0, note)
