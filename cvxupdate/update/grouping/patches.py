"""Groups by total variation between neighbours: patches of one change with few edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from cvxupdate.convex import CompiledStep, SolverChoice, StepProblem, with_chosen_weight
from cvxupdate.errors import InputError
from cvxupdate.registry import REGULARISERS
from cvxupdate.system import LinearSystem
from cvxupdate.update.grouping.seen import Groups

SAME = 0.02
"""Of the largest jump: below, two neighbours have one value."""


def patches(
    system: LinearSystem,
    problem: StepProblem,
    choice: SolverChoice,
    pairs: Sequence[tuple[int, int]],
    columns: Sequence[int],
) -> Groups:
    """The ``columns`` in patches of one value of the first convex step, under the clauses of
    ``problem`` and with total variation over the ``pairs`` of neighbours in place of its
    regularisers, weighted by generalised cross-validation (Rudin, Osher and Fatemi 1992).

    Raises
    ------
    InputError
        When the step is infeasible or no two parameters are neighbours.
    """
    names = tuple((problem.columns[i], problem.columns[j]) for i, j in pairs)
    varied = replace(problem, regularisers=(REGULARISERS.named("total-variation")("gcv", names),))
    varied, _ = with_chosen_weight(varied, system, choice)
    step = CompiledStep(varied, len(system.rows), choice).solve(system)
    if step.status != "optimal":
        raise InputError(f'update.parameters: grouping = "total-variation": {step.says}')
    jumps = np.array([abs(step.p[i] - step.p[j]) for i, j in pairs])
    same = np.array(pairs)[jumps <= SAME * jumps.max()].reshape(-1, 2)
    n = len(problem.columns)
    graph = sp.coo_array((np.ones(len(same)), (same[:, 0], same[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    found: dict[int, list[int]] = {}
    for column in columns:
        found.setdefault(int(label[column]), []).append(column)
    return tuple(tuple(sorted(g)) for g in found.values())
