"""OSQP: operator splitting for quadratic programs, polished on the active set (Stellato et al.
2020)."""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp

from ..matrix_form import ConeProgram
from .common import RawSolution, Solver, SolverChoice

# (step parameter rho, whether OSQP adapts it, share of the iterations). Adapting rho can swing for
# ever on programs with flat directions (L1, Huber), where a fixed one of moderate size converges.
ATTEMPTS = ((0.1, True, 0.1), (0.1, False, 0.3), (1.0, False, 0.3), (0.01, False, 0.3))


def solve(program: ConeProgram, choice: SolverChoice) -> RawSolution:
    """Solve a quadratic program: rows lower ≤ A x ≤ b, the zero cone as equalities."""
    import osqp

    P, A = sp.csc_matrix(sp.triu(program.P)), sp.csc_matrix(program.A)
    lower = np.where(np.arange(program.b.size) < program.cones.zero, program.b, -np.inf)
    start = time.perf_counter()
    done = 0
    for rho, adapt, share in ATTEMPTS:
        solver = osqp.OSQP()
        solver.setup(
            P,
            program.q,
            A,
            lower,
            program.b,
            verbose=False,
            eps_abs=choice.tolerance,
            eps_rel=choice.tolerance,
            eps_prim_inf=1e-8,
            eps_dual_inf=1e-8,
            polishing=choice.polish,
            rho=rho,
            adaptive_rho=adapt,
            max_iter=max(25, int(share * (choice.max_iterations or 100_000))),
        )
        found = solver.solve(raise_error=False)
        word = str(found.info.status)
        done += int(found.info.iter)
        if word == "solved" or word.startswith("primal infeasible"):
            break
    status = (
        "infeasible"
        if word.startswith("primal infeasible")
        else "optimal"
        if word == "solved"
        else "stopped"
    )
    x = np.array(found.x, dtype=float)
    z = np.array(found.prim_inf_cert if status == "infeasible" else found.y, dtype=float)
    return RawSolution(
        x, z, program.b - program.A @ x, status, time.perf_counter() - start, done, word
    )


SOLVER = Solver("OSQP", frozenset(), solve)
