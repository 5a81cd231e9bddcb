"""Refine a quadratic program's solution on its active set (Stellato et al. 2020, section 4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from .certificate import Certificate, certify
from .matrix_form import ConeProgram
from .solvers.common import RawSolution, Solver, SolverChoice

# Solutions whose residuals are below this are left alone.
GOOD = 1e-8
REGULARISATION = 1e-8


def solve_certified(
    solver: Solver, program: ConeProgram, choice: SolverChoice
) -> tuple[RawSolution, Certificate]:
    """Solve, certify by our own figures, and polish a quadratic program whose certificate is not
    yet good."""
    raw = solver.solve(program, choice)
    certificate = raw.certificate or certify(program, raw.x, raw.s, raw.z)
    if (
        not choice.polish
        or program.cones.beyond_qp
        or (raw.status != "optimal" and not np.all(np.isfinite(raw.z)))
    ):
        return raw, certificate
    if certificate.worst <= GOOD or not certificate.is_optimal(1e-2):
        return raw, certificate
    better = polish(program, raw)
    improved = certify(program, better.x, better.s, better.z)
    return (better, improved) if improved.worst < certificate.worst else (raw, certificate)


def polish(program: ConeProgram, raw: RawSolution) -> RawSolution:
    """Solve the equality-constrained program of the active rows: inequalities whose multiplier
    exceeds their slack.

    The KKT matrix is regularised and the solution refined against the matrix itself, so dependent
    rows do no harm.
    """
    rows = np.arange(program.b.size)
    active = rows[(rows < program.cones.zero) | (raw.z > raw.s)]
    n, k = program.q.size, active.size
    C = sp.csr_array(program.A)[active]
    K = (
        sp.csc_array(sp.block_array([[program.P, C.T], [C, None]]))
        if k
        else sp.csc_array(program.P)
    )
    shift = sp.diags_array(
        np.concatenate([np.full(n, REGULARISATION), np.full(k, -REGULARISATION)])
    )
    right = np.concatenate([-program.q, program.b[active]])
    try:
        factors = splu(sp.csc_matrix(K + shift))
    except RuntimeError:
        return raw
    v = np.concatenate([raw.x, raw.z[active]])
    for _ in range(10):
        v = v + factors.solve(right - K @ v)
    x, z = v[:n], np.zeros(program.b.size)
    z[active] = v[n:]
    return replace(
        raw,
        x=x,
        z=z,
        s=program.b - program.A @ x,
        note=f"{raw.note}, polished".strip(", "),
        certificate=None,
    )
