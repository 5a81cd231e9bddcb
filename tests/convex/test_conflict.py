"""Clauses that cannot hold together: exactly the known conflict, a proof, a way out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cvxupdate import convex as cv
from cvxupdate.convex.constraints.clauses import stack

from ..cases.convex_cases import COLUMNS, CONFLICTS, CONSTRAINTS, system


@pytest.mark.parametrize("name", CONFLICTS)
def test_known_conflict_is_named_exactly(name):
    known = CONFLICTS[name]
    problem = cv.StepProblem(constraints=known.constraints, columns=COLUMNS)
    centre, radius = (None, None) if known.radius is None else (np.zeros(6), known.radius)
    step = cv.CompiledStep(problem, 24).solve(system(), centre, radius)
    assert step.status == "infeasible"
    assert frozenset(step.conflict) == known.clauses
    assert step.infeasibility is not None and step.infeasibility.proves(1e-6)
    assert any(known.way_out in item.says for item in step.relaxation), step.relaxation
    assert np.all(np.isnan(step.p))
    assert "cannot hold together" in step.says
    if known.radius is None:
        nearest = cv.CompiledStep(problem, 24).nearest(np.zeros(6))
        assert nearest.status == "infeasible" and frozenset(nearest.conflict) == known.clauses


@pytest.mark.parametrize("solver", cv.available_solvers())
def test_the_conflict_is_named_whichever_solver_was_asked(solver):
    known = CONFLICTS["mass out of reach"]
    problem = cv.StepProblem(constraints=known.constraints, columns=COLUMNS)
    step = cv.CompiledStep(problem, 24, cv.SolverChoice(solver)).solve(system())
    assert step.status == "infeasible" and frozenset(step.conflict) == known.clauses
    rows = cv.compare_solvers(problem, system(), [solver])
    assert rows[0].status == "infeasible" and "total mass set to 6.95 kg" in rows[0].note


@pytest.mark.parametrize("name", CONSTRAINTS)
def test_no_conflict_where_there_is_none(name):
    clauses = cv.StepProblem(constraints=CONSTRAINTS[name], columns=COLUMNS).clauses
    assert cv.find_conflict(clauses, 6) is None


def test_limits_that_just_touch_are_no_conflict():
    touching = (cv.Bounds(-0.1, 0.1), cv.LinearEquality({"a.E": 1.0, "b.E": 1.0}, 0.2))
    problem = cv.StepProblem(constraints=touching, columns=COLUMNS)
    step = cv.solve_step(problem, system())
    assert step.status == "optimal"
    np.testing.assert_allclose(step.p[[0, 2]], 0.1, atol=1e-7)
    apart = (cv.Bounds(-0.1, 0.1), cv.LinearEquality({"a.E": 1.0, "b.E": 1.0}, 0.2 + 1e-5))
    assert (
        cv.find_conflict(cv.StepProblem(constraints=apart, columns=COLUMNS).clauses, 6) is not None
    )


def test_the_way_out_works_and_less_does_not():
    known = CONFLICTS["sum beyond bounds"]
    problem = cv.StepProblem(constraints=known.constraints, columns=COLUMNS)
    item = next(
        r for r in cv.solve_step(problem, system()).relaxation if "bounds on a.E" in r.clause
    )
    assert item.amount == pytest.approx(0.3)
    for factor, feasible in ((1.001, True), (0.999, False)):
        upper = np.full(6, 0.1)
        upper[0] += factor * item.amount
        freed = (cv.Bounds(np.full(6, -0.1), upper), known.constraints[1])
        conflict = cv.find_conflict(cv.StepProblem(constraints=freed, columns=COLUMNS).clauses, 6)
        assert (conflict is None) is feasible


def test_two_conflicts_at_once_need_two_relaxations():
    constraints = (
        cv.Bounds(-0.1, 0.1),
        cv.LinearEquality({"a.E": 1.0}, 0.5),
        cv.LinearEquality({"d.m": 1.0}, -0.7),
    )
    step = cv.solve_step(cv.StepProblem(constraints=constraints, columns=COLUMNS), system())
    assert len(step.conflict) == 2
    assert {item.alone for item in step.relaxation} == {False}
    assert len(step.relaxation) == 2


def _feasible(clauses, n: int) -> bool:
    rows = stack(clauses, n)
    C = rows.C.toarray()
    answer = linprog(
        np.zeros(n),
        np.vstack([C, -C]),
        np.concatenate([rows.upper, -rows.lower]),
        bounds=(None, None),
    )
    return bool(answer.status == 0)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_random_conflicts_are_real_and_irreducible(seed):
    """Against an independent feasibility test: the set is infeasible, and feasible without any one
    of its clauses."""
    rng = np.random.default_rng(seed)
    n = 5
    clauses = []
    for k in range(14):
        rows = int(rng.integers(1, 3))
        on = tuple(map(int, rng.choice(n, size=int(rng.integers(1, 4)), replace=False)))
        C = rng.integers(-2, 3, size=(rows, len(on))).astype(float)
        middle, width = rng.normal(size=rows), rng.choice([0.0, 0.5, 2.0])
        clauses.append(cv.LinearClause(f"clause {k}", on, C, middle - width, middle + width))
    conflict = cv.find_conflict(clauses, n)
    if conflict is None:
        assert _feasible(clauses, n)
        return
    core = [clause for clause in clauses if clause.name in conflict.clauses]
    assert not _feasible(core, n)
    for left_out in core:
        assert _feasible([clause for clause in core if clause is not left_out], n)
    assert conflict.proof.proves()


def test_a_thousand_bounds():
    n = 1000
    columns = tuple(f"e{i}.E" for i in range(n))
    mass = np.linspace(0.5, 1.0, n)
    short = (cv.Bounds(-0.1, 0.1), cv.LinearEquality({"e3.E": 1.0, "e700.E": 1.0}, 0.5))
    conflict = cv.find_conflict(cv.StepProblem(constraints=short, columns=columns).clauses, n)
    assert conflict is not None
    assert set(conflict.clauses) == {
        "bounds on e3.E: -0.1 to 0.1",
        "bounds on e700.E: -0.1 to 0.1",
        "e3.E + e700.E = 0.5",
    }
    everything = (cv.Bounds(-0.1, 0.1), cv.TotalMass(mass, base=10.0, value=100.0))
    conflict = cv.find_conflict(cv.StepProblem(constraints=everything, columns=columns).clauses, n)
    assert conflict is not None and len(conflict.clauses) == n + 1
    assert '"total mass set to 100 kg" is let go by -15 kg' in conflict.relaxation[0].says
    assert any(
        "each of the 1000 limits" in item.says and "0.02" in item.says
        for item in conflict.relaxation
    )
