"""The quadratic-program back ends of qpsolvers: PIQP, DAQP, quadprog, HiGHS, whichever are
installed.

Residual variables are eliminated first, so that these (mostly dense) solvers see a program in the
parameters alone.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...system import Array
from ..eliminate import eliminate
from ..matrix_form import ConeProgram
from .common import RawSolution, Solver, SolverChoice, no_solution, quiet


@dataclass(frozen=True)
class Backend:
    """A solver of qpsolvers: which matrices it takes, what it needs, and its keywords.

    Tolerances are ``factor`` times the one asked for, at least ``floor``; ``fixed`` are further
    keywords.
    """

    name: str
    dense: bool = True
    strictly_convex: bool = False
    tolerances: tuple[str, ...] = ()
    factor: float = 1.0
    floor: float = 0.0
    iterations: str = ""
    default_iterations: int = 0
    fixed: tuple[tuple[str, float], ...] = ()

    def keywords(self, choice: SolverChoice) -> Mapping[str, float | int]:
        """The options for this choice."""
        tolerance = max(self.factor * choice.tolerance, self.floor)
        words: dict[str, float | int] = dict(self.fixed) | dict.fromkeys(self.tolerances, tolerance)
        if self.iterations:
            words[self.iterations] = choice.max_iterations or self.default_iterations
        return words

    def solve(self, program: ConeProgram, choice: SolverChoice) -> RawSolution:
        """Solve a quadratic program."""
        import qpsolvers

        start = time.perf_counter()
        reduced = eliminate(program)
        small = reduced.small
        zero = small.cones.zero
        if self.strictly_convex and not _positive_definite(small.P.toarray()):
            note = (
                f"{self.name.upper()} needs a strictly convex objective; this one has flat "
                "directions"
            )
            return no_solution(program, "refused", time.perf_counter() - start, note)
        E, G = sp.csc_array(small.A[:zero]), sp.csc_array(small.A[zero:])
        matrices = [M.toarray() if self.dense else sp.csc_matrix(M) for M in (small.P, G, E)]
        problem = qpsolvers.Problem(
            matrices[0],
            small.q,
            matrices[1] if G.shape[0] else None,
            small.b[zero:] if G.shape[0] else None,
            matrices[2] if zero else None,
            small.b[:zero] if zero else None,
        )
        try:
            with quiet():
                found = qpsolvers.solve_problem(problem, self.name, **self.keywords(choice))
        except (qpsolvers.QPError, ValueError, RuntimeError, np.linalg.LinAlgError) as error:
            return no_solution(
                program, "stopped", time.perf_counter() - start, f"{type(error).__name__}: {error}"
            )
        seconds = time.perf_counter() - start
        if found.x is None or not np.all(np.isfinite(found.x)):
            return no_solution(program, "stopped", seconds, "no solution returned")
        z_small = np.concatenate([_or_zeros(found.y, zero), _or_zeros(found.z, G.shape[0])])
        x, z = reduced.restore(np.asarray(found.x), z_small)
        return RawSolution(
            x, z, program.b - program.A @ x, "optimal" if found.found else "stopped", seconds
        )


def _or_zeros(v: Array | None, size: int) -> Array:
    return np.zeros(size) if v is None or v.size == 0 else np.asarray(v, dtype=float)


def _positive_definite(P: Array) -> bool:
    scale = np.sqrt(np.maximum(np.diag(P), 0.0))
    if np.any(scale == 0):
        return False
    try:
        pivots = np.diag(np.linalg.cholesky(P / np.outer(scale, scale)))
    except np.linalg.LinAlgError:
        return False
    return bool(np.min(pivots) > 1e-7)


# PIQP tests absolute residuals of a scaled program, so it is asked for more; HiGHS adds a
# regularisation of 1e-7 unless told.
BACKENDS = (
    Backend(
        "piqp",
        tolerances=("eps_abs", "eps_rel"),
        factor=1e-3,
        floor=1e-13,
        iterations="max_iter",
        default_iterations=500,
    ),
    Backend(
        "daqp",
        tolerances=("primal_tol", "dual_tol"),
        floor=1e-11,
        iterations="iter_limit",
        default_iterations=20_000,
    ),
    Backend("quadprog", strictly_convex=True),
    Backend(
        "highs",
        dense=False,
        tolerances=("primal_feasibility_tolerance", "dual_feasibility_tolerance"),
        floor=1e-10,
        fixed=(("qp_regularization_value", 1e-10),),
    ),
)


def installed_backends() -> tuple[Solver, ...]:
    """Those back ends whose package is installed."""
    import qpsolvers

    installed = set(qpsolvers.available_solvers)
    return tuple(
        Solver(back.name.upper(), frozenset(), back.solve)
        for back in BACKENDS
        if back.name in installed
    )
