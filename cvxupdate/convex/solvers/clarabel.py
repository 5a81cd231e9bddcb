"""Clarabel: interior point, every cone (Goulart & Chen 2024)."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..certificate import certify
from ..eliminate import eliminate, filled_by_squares
from ..matrix_form import ConeProgram
from .common import RawSolution, Solver, SolverChoice

# Above this many entries of A and P the residual variables are eliminated first and the supernodal
# factorisation is used (measured at 1000 parameters: 10.6 s with QDLDL, 2.3 s supernodal, 0.5 s
# eliminated as well).
LARGE = 20_000
# Residuals above this call for another attempt, at most so many.
GOOD = 1e-8
RETRIES = 3


def solve(program: ConeProgram, choice: SolverChoice) -> RawSolution:
    """Solve a cone program, again with another scale of the objective when our own certificate is
    not good.

    The scale matters to an interior-point method: with weights of 1e8 Clarabel can take a feasible
    program for infeasible.
    """
    start = time.perf_counter()
    scale = 1.0
    raw = best = _solve_scaled(program, choice, scale)
    proof = certify(program, raw.x, raw.s, raw.z)
    worst = proof.worst
    for _ in range(RETRIES):
        if worst <= max(GOOD, 10 * choice.tolerance):
            break
        size = abs(program.objective(raw.x) - program.constant) if raw.status == "optimal" else 0.0
        scale = scale / 1000 if size == 0.0 or abs(np.log10(scale * size / 10)) < 0.5 else 10 / size
        raw = _solve_scaled(program, choice, scale)
        found = certify(program, raw.x, raw.s, raw.z)
        if found.worst < worst:
            best, proof, worst = raw, found, found.worst
    return replace(best, seconds=time.perf_counter() - start, certificate=proof)


def _solve_scaled(program: ConeProgram, choice: SolverChoice, scale: float) -> RawSolution:
    scaled = program
    if scale != 1.0:
        scaled = replace(program, P=program.P * scale, q=program.q * scale)
    if program.A.nnz + program.P.nnz <= LARGE:
        dense = sum((k * (k + 1) // 2) ** 2 for k in program.cones.psd)
        raw = _solve(scaled, choice, "faer" if dense > LARGE else "qdldl")
        return replace(raw, z=raw.z / scale)
    if filled_by_squares(program) > program.A.nnz + program.P.nnz:
        # Far fewer residuals than parameters: their squares fill a matrix that they leave sparse.
        raw = _solve(scaled, choice, "faer")
        return replace(raw, z=raw.z / scale)
    reduced = eliminate(scaled)
    raw = _solve(reduced.small, choice, "faer")
    if raw.status == "optimal":
        x, z = reduced.restore(raw.x, raw.z)
        s = program.b - program.A @ x
        s[reduced.rows] = raw.s
        if certify(scaled, x, s, z).is_optimal(max(1e-7, 10 * choice.tolerance)):
            return replace(raw, x=x, z=z / scale, s=s)
    # Elimination squares the condition number; where that was too much, the program as it stands
    # decides.
    raw = _solve(scaled, choice, "faer")
    return replace(raw, z=raw.z / scale)


def _solve(program: ConeProgram, choice: SolverChoice, factorisation: str) -> RawSolution:
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = choice.max_iterations or 200
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = choice.tolerance
    settings.direct_solve_method = factorisation
    c = program.cones
    cones = [clarabel.ZeroConeT(c.zero)] if c.zero else []
    cones += [clarabel.NonnegativeConeT(c.nonneg)] if c.nonneg else []
    cones += [clarabel.SecondOrderConeT(k) for k in c.soc] + [
        clarabel.PSDTriangleConeT(k) for k in c.psd
    ]
    cones += [clarabel.ExponentialConeT() for _ in range(c.exp)]
    P, A = sp.csc_matrix(_upper(program.P)), sp.csc_matrix(program.A)
    start = time.perf_counter()
    found = clarabel.DefaultSolver(P, program.q, A, program.b, cones, settings).solve()
    seconds = time.perf_counter() - start
    word = str(found.status)
    status = (
        "optimal"
        if word in ("Solved", "AlmostSolved")
        else "infeasible"
        if "PrimalInfeasible" in word
        else "stopped"
    )
    x, z, s = np.asarray(found.x), np.asarray(found.z), np.asarray(found.s)
    return RawSolution(x, z, s, status, seconds, int(found.iterations), word)


def _upper(P: Any) -> Any:
    """The upper triangle; of a diagonal matrix, as most are, itself."""
    column = np.repeat(np.arange(P.shape[1]), np.diff(P.indptr))
    return P if np.all(P.indices <= column) else sp.triu(P)


SOLVER = Solver("CLARABEL", frozenset({"soc", "psd", "exp"}), solve)
