"""Solvers, one small adapter each: a cone program in, a raw solution out."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

from ...errors import InputError
from . import clarabel, osqp, proxqp, quadratic, scs
from .common import RawSolution, Solver, SolverChoice, no_solution

# The package that each adapter needs.
NATIVE = (
    ("clarabel", clarabel.SOLVER),
    ("osqp", osqp.SOLVER),
    ("scs", scs.SOLVER),
    ("proxsuite", proxqp.SOLVER),
)


@cache
def installed() -> tuple[Solver, ...]:
    """Every solver whose package is installed."""
    native = tuple(solver for package, solver in NATIVE if find_spec(package) is not None)
    return native + (quadratic.installed_backends() if find_spec("qpsolvers") is not None else ())


def available_solvers() -> tuple[str, ...]:
    """Names of the installed solvers, Clarabel first."""
    return tuple(solver.name for solver in installed())


def solver_named(name: str) -> Solver:
    """The solver of that name, in capitals or not; InputError lists the installed ones."""
    for solver in installed():
        if solver.name == name.upper():
            return solver
    raise InputError(
        f"solver {name!r} is not installed or not known; installed are "
        f"{', '.join(available_solvers())}."
    )


__all__ = [
    "RawSolution",
    "Solver",
    "SolverChoice",
    "available_solvers",
    "installed",
    "no_solution",
    "solver_named",
]
