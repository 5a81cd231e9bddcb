"""SCS: operator splitting, every cone (O'Donoghue 2021)."""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp

from ...system import Array
from ..matrix_form import ConeProgram, Cones
from .common import RawSolution, Solver, SolverChoice


def lower_triangle_order(cones: Cones) -> Array:
    """Row order that turns upper triangles by columns (ours) into lower triangles by columns
    (SCS's)."""
    before = cones.zero + cones.nonneg + sum(cones.soc)
    order = [np.arange(before)]
    at = before
    for k in cones.psd:
        place = np.zeros((k, k), dtype=int)
        columns, rows = np.tril_indices(k)
        place[rows, columns] = place[columns, rows] = np.arange(columns.size)
        order.append(at + np.concatenate([place[j:, j] for j in range(k)]))
        at += k * (k + 1) // 2
    order.append(np.arange(at, cones.rows))
    return np.asarray(np.concatenate(order))


def solve(program: ConeProgram, choice: SolverChoice) -> RawSolution:
    """Solve a cone program."""
    import scs

    order = lower_triangle_order(program.cones)
    c = program.cones
    data = {
        "P": sp.csc_matrix(sp.triu(program.P)),
        "A": sp.csc_matrix(program.A[order]),
        "b": program.b[order],
        "c": program.q,
    }
    start = time.perf_counter()
    solver = scs.SCS(
        data,
        {"z": c.zero, "l": c.nonneg, "q": list(c.soc), "s": list(c.psd), "ep": c.exp},
        verbose=False,
        eps_abs=choice.tolerance,
        eps_rel=choice.tolerance,
        eps_infeas=1e-9,
        max_iters=choice.max_iterations or 200_000,
    )
    found = solver.solve()
    seconds = time.perf_counter() - start
    word = str(found["info"]["status"])
    status = (
        "infeasible"
        if word.startswith("infeasible")
        else "optimal"
        if word.startswith("solved")
        else "stopped"
    )
    z, s = np.empty(program.b.size), np.empty(program.b.size)
    z[order], s[order] = found["y"], found["s"]
    return RawSolution(
        np.asarray(found["x"]), z, s, status, seconds, int(found["info"]["iter"]), word
    )


SOLVER = Solver("SCS", frozenset({"soc", "psd", "exp"}), solve)
