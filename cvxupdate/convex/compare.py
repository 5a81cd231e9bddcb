"""The same step by every solver, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..system import Array, LinearSystem
from .certificate import NO_CERTIFICATE, Certificate
from .conflict import find_conflict
from .matrix_form import ConeProgram, cone_program
from .polish import solve_certified
from .problem import StepProblem, compile_step
from .solvers import SolverChoice, available_solvers, solver_named
from .solvers.common import Solver
from .step import ACCEPTED
from .weight import with_chosen_weight


@dataclass(frozen=True)
class SolverRow:
    """One solver's answer: ``status`` optimal, infeasible, stopped or refused; ``objective``
    recomputed from p by numpy; ``certificate`` recomputed from the solver's primal and dual;
    ``seconds`` inside the solver; ``note`` why not, in words.
    """

    solver: str
    status: str
    objective: float
    certificate: Certificate
    seconds: float
    iterations: int = 0
    note: str = ""


def compare_solvers(
    problem: StepProblem,
    system: LinearSystem,
    names: Sequence[str] | None = None,
    choice: SolverChoice | None = None,
) -> tuple[SolverRow, ...]:
    """Solve one step by each named solver (all installed ones if None), from one and the same cone
    program.

    ``choice`` gives tolerance, iterations and polish for all. Raises InputError when a name is not
    installed.
    """
    asked = choice or SolverChoice()
    chosen, _ = with_chosen_weight(problem, system, asked)
    chosen.check(system)
    R, d, _ = chosen.loss.reduce(*system.weighted())
    model = compile_step(chosen, len(system.rows), box=False)
    model.set_data(R, d, chosen.weights)
    program, (at,) = cone_program(model.problem, model.p)

    def objective(x: Array) -> float:
        p = x[at : at + len(chosen.columns)]
        return chosen.objective(system, p) if np.all(np.isfinite(p)) else np.nan

    rows = tuple(
        _row(solver_named(name), program, asked, objective) for name in names or available_solvers()
    )
    return _with_conflict(rows, chosen)


def _row(
    solver: Solver, program: ConeProgram, asked: SolverChoice, objective: Callable[[Array], float]
) -> SolverRow:
    """One solver's answer to the program, judged by our own certificate."""
    refusal = solver.refusal(program)
    if refusal:
        return SolverRow(solver.name, "refused", np.nan, NO_CERTIFICATE, 0.0, 0, refusal)
    raw, certificate = solve_certified(solver, program, replace(asked, name=solver.name))
    if raw.status == "refused":
        return SolverRow(solver.name, "refused", np.nan, NO_CERTIFICATE, 0.0, 0, raw.note)
    status = raw.status
    if status != "infeasible":
        proven = certificate.is_optimal(max(ACCEPTED, 10 * asked.tolerance))
        status = "optimal" if proven else "stopped"
    why_not = f"{raw.note} (largest residual {certificate.worst:.1e})".strip()
    return SolverRow(
        solver.name,
        status,
        np.nan if status == "infeasible" else objective(raw.x),
        certificate,
        raw.seconds,
        raw.iterations,
        "" if status == "optimal" else why_not,
    )


def _with_conflict(rows: tuple[SolverRow, ...], problem: StepProblem) -> tuple[SolverRow, ...]:
    """Where a solver reached no optimum because the clauses cannot hold together, its row says
    so."""
    unsolved = ("infeasible", "stopped")
    if not any(row.status in unsolved for row in rows):
        return rows
    conflict = find_conflict(problem.clauses, len(problem.columns))
    if conflict is None:
        return rows
    note = "these clauses cannot hold together: " + "; ".join(conflict.clauses[:6])
    return tuple(
        replace(row, status="infeasible", objective=np.nan, note=note)
        if row.status in unsolved
        else row
        for row in rows
    )


def spread(rows: Sequence[SolverRow]) -> float:
    """Largest relative difference between the objectives of the rows that are optimal; InputError
    when none is."""
    values = [row.objective for row in rows if row.status == "optimal"]
    if not values:
        raise InputError(
            "no solver reached the optimum of this step; its certificate and note say why for each."
        )
    return (max(values) - min(values)) / max(1.0, abs(min(values)))
