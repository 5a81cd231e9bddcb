"""The same step by every solver, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..system import LinearSystem
from .certificate import NO_CERTIFICATE, Certificate
from .conflict import find_conflict
from .matrix_form import cone_program
from .polish import solve_certified
from .problem import StepProblem, compile_step
from .solvers import SolverChoice, available_solvers, solver_named
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
    n = len(chosen.columns)
    rows = []
    for name in names or available_solvers():
        solver = solver_named(name)
        refusal = solver.refusal(program)
        if refusal:
            rows.append(SolverRow(solver.name, "refused", np.nan, NO_CERTIFICATE, 0.0, 0, refusal))
            continue
        raw, certificate = solve_certified(solver, program, replace(asked, name=solver.name))
        if raw.status == "refused":
            rows.append(SolverRow(solver.name, "refused", np.nan, NO_CERTIFICATE, 0.0, 0, raw.note))
            continue
        status = raw.status
        if status != "infeasible":
            status = (
                "optimal"
                if certificate.is_optimal(max(ACCEPTED, 10 * asked.tolerance))
                else "stopped"
            )
        p = raw.x[at : at + n]
        objective = (
            chosen.objective(system, p)
            if status != "infeasible" and np.all(np.isfinite(p))
            else np.nan
        )
        note = (
            ""
            if status == "optimal"
            else f"{raw.note} (largest residual {certificate.worst:.1e})".strip()
        )
        rows.append(
            SolverRow(
                solver.name, status, objective, certificate, raw.seconds, raw.iterations, note
            )
        )
    if any(row.status in ("infeasible", "stopped") for row in rows):
        conflict = find_conflict(chosen.clauses, n)
        if conflict is not None:
            words = "these clauses cannot hold together: " + "; ".join(conflict.clauses[:6])
            rows = [
                replace(row, status="infeasible", objective=np.nan, note=words)
                if row.status in ("infeasible", "stopped")
                else row
                for row in rows
            ]
    return tuple(rows)


def spread(rows: Sequence[SolverRow]) -> float:
    """Largest relative difference between the objectives of the rows that are optimal; InputError
    when none is."""
    values = [row.objective for row in rows if row.status == "optimal"]
    if not values:
        raise InputError(
            "no solver reached the optimum of this step; its certificate and note say why for each."
        )
    return (max(values) - min(values)) / max(1.0, abs(min(values)))
