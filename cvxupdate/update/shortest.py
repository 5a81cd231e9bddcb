"""The shortest of all steps that fit the linearised equations equally well (2.101)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from cvxupdate.convex import CompiledStep, LinearClause, SolverChoice, Step, StepProblem
from cvxupdate.convex.constraints.clauses import Clause
from cvxupdate.errors import InputError
from cvxupdate.system import Array, LinearSystem

SEEN = 1e-8
"""Singular value of the weighted equations, of the largest, below which a direction is not seen by
them: the solver meets them no better."""


@dataclass(frozen=True, eq=False)
class MetAsWell:
    """The combinations ``rows`` (k, n) of the parameters that the equations see keep their
    ``values`` (k,)."""

    rows: Array
    values: Array
    keys: ClassVar[Mapping[str, Any]] = {}

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause of all of them."""
        every = tuple(range(len(columns)))
        name = "equations met as well as can be"
        return (LinearClause(name, every, self.rows, self.values, self.values),)


def shortest(
    problem: StepProblem,
    system: LinearSystem,
    step: Step,
    centre: Array,
    radius: Array,
    choice: SolverChoice,
) -> Step:
    """Of all p that meet the equations as ``step`` does, within the problem's clauses and the trust
    region, the nearest to ``centre`` (2.101, Chen and Garba 1980): a second convex step, whose
    certificate it carries. ``step`` itself where that fails to improve on it.

    With more parameters than measurements the first step is one of many; this one moves only what
    the measurements ask to be moved. Without clauses it is S† Δw.
    """
    J, _ = system.weighted()
    _, s, Vt = np.linalg.svd(J, full_matrices=False)
    rows = Vt[s > SEEN * s.max(initial=0.0)]
    if len(rows) == len(centre):
        return step  # nothing is open
    n = len(centre)
    bound = replace(
        problem,
        regularisers=(),
        constraints=(*problem.constraints, MetAsWell(rows, rows @ step.p)),
    )
    itself = LinearSystem(np.eye(n), centre, np.ones(n), system.columns, system.columns)
    found = CompiledStep(bound, n, choice).solve(itself, centre=centre, radius=radius)
    if found.status != "optimal":
        return step
    active = tuple(name for name in found.active if not name.startswith("equations met"))
    value = problem.objective(system, found.p, present=centre)
    return replace(found, objective=value, active=active, seconds=step.seconds + found.seconds)


def check_shortest(problem: StepProblem, path: object) -> None:
    """InputError where a penalty leaves no step to choose among."""
    if problem.regularisers:
        names = ", ".join(r.name for r in problem.regularisers)
        raise InputError(
            f'{path}: update.solution = "minimum-norm" takes the shortest of the steps that fit '
            f"equally well, but the penalty {names} leaves one only. Leave one of them out."
        )
