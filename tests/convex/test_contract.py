"""The contract of the room: every loss × regulariser × constraint × solver that takes the cone."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import convex as cv
from cvxupdate.convex.compare import spread
from cvxupdate.convex.constraints.clauses import violation

from ..cases.convex_cases import COLUMNS, CONSTRAINTS, LOSSES, REGULARISERS, system
from .tolerances import TOLERANCES

TAKES_CONES = {"CLARABEL", "SCS"}


def test_every_installed_solver_has_its_tolerance():
    assert set(cv.available_solvers()) == set(TOLERANCES)


@pytest.mark.parametrize("constraint", CONSTRAINTS)
@pytest.mark.parametrize("regulariser", REGULARISERS)
@pytest.mark.parametrize("loss", LOSSES)
def test_all_solvers_reach_the_same_certified_optimum(loss, regulariser, constraint):
    data = system()
    problem = cv.StepProblem(
        LOSSES[loss], REGULARISERS[regulariser], CONSTRAINTS[constraint], COLUMNS
    )
    rows = {row.solver: row for row in cv.compare_solvers(problem, data)}
    conic = regulariser == "group-l1" or constraint == "norm"
    # Flat directions: the bounding variables of |.| carry no curvature.
    strict = loss == "least-squares" and regulariser in ("none", "tikhonov")
    best = rows["CLARABEL"].objective
    for name, row in rows.items():
        if conic and name not in TAKES_CONES:
            assert row.status == "refused"
            assert f"{name} cannot take the second-order cone" in row.note
        elif name == "QUADPROG" and not strict:
            assert row.status == "refused"
            assert "strictly convex" in row.note
        else:
            allowed = TOLERANCES[name]
            assert row.status == "optimal", row
            assert row.objective == pytest.approx(best, rel=allowed.objective), name
            assert row.certificate.is_optimal(allowed.certificate), (name, row.certificate)
    assert spread(tuple(rows.values())) <= 1e-6
    step = cv.solve_step(problem, data)
    assert step.status == "optimal"
    assert step.objective == pytest.approx(best, rel=1e-9)
    for clause in problem.clauses:
        assert violation(clause, step.p) <= TOLERANCES["CLARABEL"].feasible


@pytest.mark.parametrize("name", [n for n in TOLERANCES if n != "QUADPROG"])
def test_compiled_step_runs_with_every_solver_and_stays_feasible(name):
    data = system()
    problem = cv.StepProblem(cv.LeastSquares(), REGULARISERS["l1"], CONSTRAINTS["several"], COLUMNS)
    step = cv.CompiledStep(problem, 24, cv.SolverChoice(name)).solve(data, np.zeros(6), 0.2)
    assert step.status == "optimal"
    assert np.max(np.abs(step.p)) <= 0.2 + TOLERANCES[name].feasible
    assert max(violation(clause, step.p) for clause in problem.clauses) <= TOLERANCES[name].feasible
    assert step.certificate.is_optimal(TOLERANCES[name].certificate)


def test_no_feasible_point_near_the_optimum_is_better():
    """First-order optimality without any dual: random feasible points near p never have a lower
    objective."""
    data = system()
    rng = np.random.default_rng(0)
    for loss in LOSSES.values():
        problem = cv.StepProblem(loss, REGULARISERS["group-l1"], CONSTRAINTS["norm"], COLUMNS)
        compiled = cv.CompiledStep(problem, 24)
        step = compiled.solve(data)
        for size in (1e-4, 1e-2, 1e-1):
            for _ in range(5):
                other = compiled.nearest(step.p + size * rng.normal(size=6)).p
                assert problem.objective(data, other) >= step.objective * (1 - 1e-8)
