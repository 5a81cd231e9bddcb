"""ProxQP: proximal augmented Lagrangian for quadratic programs (Bambade et al. 2022).

Called directly: through qpsolvers its infeasibility test stays at 1e-4, which takes programs
without curvature for infeasible.
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

import numpy as np

from ..eliminate import eliminate
from ..matrix_form import ConeProgram
from .common import RawSolution, Solver, SolverChoice, no_solution


def solve(program: ConeProgram, choice: SolverChoice) -> RawSolution:
    """Solve a quadratic program, dense, in the variables that are left after elimination."""
    proxqp: Any = import_module("proxsuite").proxqp

    start = time.perf_counter()
    reduced = eliminate(program)
    small, zero = reduced.small, reduced.small.cones.zero
    rows = small.b.size - zero
    qp = proxqp.dense.QP(small.q.size, zero, rows)
    qp.settings.eps_abs, qp.settings.eps_rel = choice.tolerance, 0.0
    qp.settings.eps_primal_inf = qp.settings.eps_dual_inf = 1e-14
    qp.settings.max_iter = choice.max_iterations or 2_000
    A = small.A.toarray()
    qp.init(
        small.P.toarray(),
        small.q,
        A[:zero],
        small.b[:zero],
        A[zero:],
        np.full(rows, -1e20),
        small.b[zero:],
    )
    qp.solve()
    found = qp.results
    word = str(found.info.status).rpartition(".")[2]
    if not np.all(np.isfinite(found.x)):
        return no_solution(program, "stopped", time.perf_counter() - start, word)
    x, z = reduced.restore(np.asarray(found.x), np.concatenate([found.y, found.z]))
    status = "optimal" if word == "PROXQP_SOLVED" else "stopped"
    seconds = time.perf_counter() - start
    return RawSolution(x, z, program.b - program.A @ x, status, seconds, int(found.info.iter), word)


SOLVER = Solver("PROXQP", frozenset(), solve)
