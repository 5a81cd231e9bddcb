"""One step, once: the weight chosen where it is a rule, compiled, solved."""

from __future__ import annotations

from ..system import LinearSystem
from .problem import StepProblem
from .solvers import SolverChoice
from .step import CompiledStep, Step
from .weight import with_chosen_weight


def solve_step(
    problem: StepProblem, system: LinearSystem, solver: SolverChoice | None = None
) -> Step:
    """Compile and solve once; a weight that is a rule is chosen first."""
    choice = solver or SolverChoice()
    chosen, _ = with_chosen_weight(problem, system, choice)
    return CompiledStep(chosen, len(system.rows), choice).solve(system)
