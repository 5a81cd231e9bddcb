"""The contract of the room: every loss × regulariser × constraint × solver that takes the cone."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import convex as cv
from cvxupdate.convex.compare import spread
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.registry import CONSTRAINTS as CONSTRAINTS_KNOWN
from cvxupdate.registry import REGULARISERS as REGULARISERS_KNOWN
from cvxupdate.spec.grammar import grammar

from ..cases.convex_cases import (
    CASE_COLUMNS,
    COLUMNS,
    CONES,
    CONSTRAINTS,
    ENTRIES,
    LOSSES,
    PENALTIES,
    REGULARISERS,
    TABLES,
    Bench,
    regularisers,
    system,
)
from .tolerances import TOLERANCES

TAKES_CONES = {"CLARABEL", "SCS"}
FIRST = ("none", "tikhonov", "l1", "group-l1", "total-variation")
SLOW = {("OSQP", "budget of the sum")}
"""Where a solver may give up, and says so: splitting crawls along the flat faces of an active
budget of absolute changes, whose active set is degenerate."""
AGAIN = ("mirror", "tied groups", "equations", "element mass")  # rows that others have as well


class NoWhole(Bench):
    """No whole matrix is free."""

    def whole(self):
        return ()


def test_every_installed_solver_has_its_tolerance():
    assert set(cv.available_solvers()) == set(TOLERANCES)


@pytest.mark.parametrize("registry", [CONSTRAINTS_KNOWN, REGULARISERS_KNOWN], ids=lambda r: r.kind)
def test_every_registered_member_has_a_case(registry):
    """A part that is listed, but that no contract test runs over, is a fault of the cases."""
    cases = CONSTRAINTS if registry is CONSTRAINTS_KNOWN else REGULARISERS
    tried = {type(part) for parts in cases.values() for part in parts}
    assert set(registry.members()) == tried


def test_every_loss_has_a_case():
    assert {type(loss) for loss in LOSSES.values()} == set(cv.LOSSES)


def test_every_key_of_the_problem_file_has_a_table():
    assert set(TABLES) == {key for kind in CONSTRAINTS_KNOWN.members() for key in kind.keys}


@pytest.mark.parametrize("key", TABLES)
def test_a_table_makes_one_constraint_whose_clauses_stand(key):
    """Whatever owns the key reads its table; others that share the key leave it alone; the clauses
    fit the parameters and have names of their own."""
    bench = Bench(ENTRIES) if key == "symmetry" else Bench()
    if key == "total_mass":
        bench = NoWhole()
    owners = [kind for kind in CONSTRAINTS_KNOWN.members() if key in kind.keys]
    table = owners[0].keys[key].table(**TABLES[key])
    made = [kind.from_spec(table, bench) for kind in owners]
    (one,) = [constraint for constraint in made if constraint is not None]
    clauses = one.clauses(bench.columns)
    assert clauses and len({c.name for c in clauses}) == len(clauses)
    problem = cv.StepProblem(constraints=(one,), columns=bench.columns)
    assert cv.solve_step(problem, system(columns=bench.columns)).status == "optimal"


@pytest.mark.parametrize("kind", REGULARISERS_KNOWN.members(), ids=lambda k: k.name)
def test_a_penalty_is_read_from_its_table(kind):
    """The weight of the file is that of the penalty, which is 0 or more and known to its name."""
    table = grammar().model_fields["regularisation"].annotation.__args__[0]
    made = kind.from_spec(
        table(kind=kind.name, weight=3.0, **PENALTIES.get(kind.name, {})), Bench()
    )
    assert (made.weight, made.name) == (3.0, kind.name)
    assert made.value(np.full(6, 0.1), COLUMNS) >= 0.0


def combinations():
    """Every loss with every regulariser, every loss with every constraint, every regulariser with
    every constraint; and all three together for the linear ones."""
    linear = [c for c in CONSTRAINTS if c not in CONES and c not in AGAIN]
    for loss in LOSSES:
        for regulariser in REGULARISERS:
            for constraint in CONSTRAINTS:
                plain = (loss == "least-squares") + (regulariser == "none") + (constraint == "none")
                if plain or (constraint in linear and regulariser in FIRST and loss != "norm"):
                    yield loss, regulariser, constraint


@pytest.mark.parametrize(("loss", "regulariser", "constraint"), list(combinations()))
def test_all_solvers_reach_the_same_certified_optimum(loss, regulariser, constraint):
    columns = CASE_COLUMNS.get(constraint, COLUMNS)
    data = system(columns=columns)
    problem = cv.StepProblem(
        LOSSES[loss], regularisers(columns)[regulariser], CONSTRAINTS[constraint], columns
    )
    rows = {row.solver: row for row in cv.compare_solvers(problem, data)}
    cones = [CONES[part] for part in (loss, regulariser, constraint) if part in CONES]
    # Flat directions: the bounding variables of |.| carry no curvature.
    flat = loss != "least-squares" or regulariser not in ("none", "tikhonov", "prior")
    strict = not flat and constraint not in ("budget of the sum",)
    best = rows["CLARABEL"].objective
    for name, row in rows.items():
        if cones and name not in TAKES_CONES:
            assert row.status == "refused"
            assert all(cone in row.note for cone in cones)
        elif name == "QUADPROG" and not strict:
            assert row.status == "refused"
            assert "strictly convex" in row.note
        elif row.status == "stopped":
            assert (name, constraint) in SLOW and "maximum iterations" in row.note
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
