"""OSQP: operator splitting for quadratic programs, polished on the active set (Stellato et al. 2020)."""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp

from ..matrix_form import ConeProgram
from .common import RawSolution, Solver, SolverChoice


def solve(program: ConeProgram, choice: SolverChoice) -> RawSolution:
    """Solve a quadratic program: rows lower ≤ A x ≤ b, the zero cone as equalities."""
    import osqp

    lower = np.where(np.arange(program.b.size) < program.cones.zero, program.b, -np.inf)
    start = time.perf_counter()
    solver = osqp.OSQP()
    solver.setup(
        sp.csc_matrix(sp.triu(program.P)),
        program.q,
        sp.csc_matrix(program.A),
        lower,
        program.b,
        verbose=False,
        eps_abs=choice.tolerance,
        eps_rel=choice.tolerance,
        eps_prim_inf=1e-8,
        eps_dual_inf=1e-8,
        polishing=choice.polish,
        max_iter=choice.max_iterations or 100_000,
        check_termination=25,
    )
    found = solver.solve(raise_error=False)
    seconds = time.perf_counter() - start
    word = str(found.info.status)
    status = (
        "infeasible" if word.startswith("primal infeasible") else "optimal" if word.startswith("solved") else "stopped"
    )
    x = np.array(found.x, dtype=float)
    z = np.array(found.prim_inf_cert if status == "infeasible" else found.y, dtype=float)
    return RawSolution(x, z, program.b - program.A @ x, status, seconds, int(found.info.iter), word)


SOLVER = Solver("OSQP", frozenset(), solve)
