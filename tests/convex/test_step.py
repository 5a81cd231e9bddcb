"""The compiled step: DPP, reuse, size, the trust region, messages."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest

from cvxupdate import convex as cv
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.convex.matrix_form import cone_program
from cvxupdate.errors import InputError
from cvxupdate.system import LinearSystem

from ..cases.convex_cases import COLUMNS, CONSTRAINTS, LOSSES, MASS, REGULARISERS, system


@pytest.mark.parametrize("regulariser", REGULARISERS)
@pytest.mark.parametrize("loss", LOSSES)
def test_every_step_is_compiled_once_and_reused(loss, regulariser):
    problem = cv.StepProblem(
        LOSSES[loss], REGULARISERS[regulariser], CONSTRAINTS["several"], COLUMNS
    )
    compiled = cv.CompiledStep(problem, 24)
    for model in (compiled.plain, compiled.boxed, compiled.projection):
        assert model.problem.is_dcp(dpp=True)
    for seed in (1, 2):
        data = system(seed=seed)
        again = compiled.solve(data, np.full(6, 0.01), 0.15)
        fresh = cv.CompiledStep(problem, 24).solve(data, np.full(6, 0.01), 0.15)
        assert again.objective == pytest.approx(fresh.objective, rel=1e-12)
        assert again.status == "optimal" and np.max(np.abs(again.p - 0.01)) <= 0.15 + 1e-7


def test_the_second_solve_is_much_faster():
    problem = cv.StepProblem(
        cv.LeastSquares(), REGULARISERS["group-l1"], CONSTRAINTS["several"], COLUMNS
    )
    first, later = [], []
    for _ in range(3):
        compiled = cv.CompiledStep(problem, 24)
        times = []
        for _ in range(4):
            start = time.perf_counter()
            compiled.solve(system(), np.zeros(6), 0.1)
            times.append(time.perf_counter() - start)
        first.append(times[0])
        later.append(min(times[1:]))
    assert min(first) > 3 * min(later)


def test_least_squares_program_does_not_grow_with_the_rows():
    sizes = []
    for rows in (6, 24, 4000):
        data = system(rows)
        compiled = cv.CompiledStep(cv.StepProblem(columns=COLUMNS), rows)
        step = compiled.solve(data)
        WA, Wb = data.weighted()
        exact = np.linalg.lstsq(WA, Wb, rcond=None)[0]
        np.testing.assert_allclose(step.p, exact, atol=1e-7)
        assert step.objective == pytest.approx(np.sum((WA @ exact - Wb) ** 2), rel=1e-9, abs=1e-9)
        sizes.append(cone_program(compiled.plain.problem)[0].A.shape)
    assert len(set(sizes)) == 1
    same = cv.CompiledStep(cv.StepProblem(columns=COLUMNS), 24)
    assert same.solve(system(4000)).status == same.solve(system(3)).status == "optimal"


def test_rows_beyond_the_compiled_size_are_refused_for_row_by_row_losses():
    compiled = cv.CompiledStep(cv.StepProblem(cv.Huber(), columns=COLUMNS), 10)
    assert compiled.solve(system(8)).status == "optimal"
    with pytest.raises(InputError, match="compiled for 10 rows"):
        compiled.solve(system(24))


def test_infinite_radius_leaves_a_parameter_free():
    data = system(outliers=0)
    compiled = cv.CompiledStep(cv.StepProblem(columns=COLUMNS), 24)
    free = compiled.solve(data)
    same = compiled.solve(data, np.full(6, 0.5), np.full(6, np.inf))
    np.testing.assert_allclose(same.p, free.p, atol=1e-7)
    radius = np.full(6, np.inf)
    radius[2] = 0.01
    held = compiled.solve(data, np.zeros(6), radius)
    assert abs(held.p[2]) == pytest.approx(0.01, abs=1e-8)
    assert held.active == ("trust region on b.E: within 0.01 of 0",)
    WA, Wb = data.weighted()
    others = [0, 1, 3, 4, 5]
    exact = np.linalg.lstsq(WA[:, others], Wb - WA[:, 2] * held.p[2], rcond=None)[0]
    np.testing.assert_allclose(held.p[others], exact, atol=1e-7)


def test_radius_zero_holds_the_centre():
    centre = np.linspace(-0.1, 0.1, 6)
    step = cv.CompiledStep(cv.StepProblem(columns=COLUMNS), 24).solve(system(), centre, 0.0)
    assert step.status == "optimal"
    np.testing.assert_allclose(step.p, centre, atol=1e-8)


def test_nearest_is_idempotent_and_feasible():
    problem = cv.StepProblem(constraints=CONSTRAINTS["several"], columns=COLUMNS)
    compiled = cv.CompiledStep(problem, 24)
    once = compiled.nearest(np.array([1.0, -1.0, 0.3, 0.2, -0.7, 0.4]))
    assert max(violation(clause, once.p) for clause in problem.clauses) < 1e-8
    np.testing.assert_allclose(compiled.nearest(once.p).p, once.p, atol=1e-7)


def test_a_solver_out_of_iterations_says_so():
    problem = cv.StepProblem(cv.Huber(), REGULARISERS["l1"], CONSTRAINTS["several"], COLUMNS)
    step = cv.solve_step(problem, system(), cv.SolverChoice("SCS", max_iterations=3, polish=False))
    assert step.status == "stopped"
    assert "SCS stopped before it reached the optimum" in step.says
    assert not step.certificate.is_optimal(1e-6)


def test_weights_of_eight_decades_do_not_pass_for_infeasible():
    """Clarabel alone calls this program infeasible; the certificate notices and the step is solved
    at another scale."""
    data = system(outliers=0)
    scale = np.geomspace(1e-3, 1e3, 6)
    wild = LinearSystem(
        data.A * scale, data.b, data.weights * np.geomspace(1e-4, 1e4, 24), data.columns, data.rows
    )
    step = cv.solve_step(
        cv.StepProblem(constraints=(cv.Bounds(-0.2 / scale, 0.2 / scale),), columns=COLUMNS), wild
    )
    assert step.status == "optimal" and step.certificate.is_optimal(1e-6)


@pytest.mark.slow
def test_cvxpy_takes_a_small_part_of_a_large_step():
    n = 500
    rng = np.random.default_rng(0)
    A = rng.normal(size=(2 * n, n))
    columns = tuple(f"e{i}.E" for i in range(n))
    data = LinearSystem(
        A,
        A @ rng.normal(size=n) * 0.3,
        np.full(2 * n, 100.0),
        columns,
        tuple(map(str, range(2 * n))),
    )
    problem = cv.StepProblem(
        regularisers=(cv.Tikhonov(1.0),), constraints=(cv.Bounds(-0.2, 0.2),), columns=columns
    )
    compiled = cv.CompiledStep(problem, 2 * n)
    step = compiled.solve(data)
    assert step.status == "optimal" and step.certificate.is_optimal(1e-7)
    step = compiled.solve(data)
    applied = []
    for _ in range(3):
        start = time.perf_counter()
        cone_program(compiled.plain.problem)
        applied.append(time.perf_counter() - start)
    assert min(applied) < 0.3 * step.seconds


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cv.StepProblem(columns=("a", "a")), "two of the same name"),
        (
            lambda: cv.StepProblem(constraints=(cv.Bounds(0.2, 0.1),), columns=COLUMNS).clauses,
            "lower limit lies above",
        ),
        (
            lambda: (
                cv.StepProblem(constraints=(cv.Bounds(np.zeros(3), 1.0),), columns=COLUMNS).clauses
            ),
            "give one of each, or 6",
        ),
        (
            lambda: cv.StepProblem(constraints=(cv.Bounds(np.nan, 1.0),), columns=COLUMNS).clauses,
            "not finite",
        ),
        (
            lambda: (
                cv.StepProblem(constraints=(cv.Tied((("a.E", "z.E"),)),), columns=COLUMNS).clauses
            ),
            "no parameter is called z.E",
        ),
        (
            lambda: cv.StepProblem(constraints=(cv.Tied((("a.E",),)),), columns=COLUMNS).clauses,
            "two or more",
        ),
        (
            lambda: (
                cv.StepProblem(constraints=(cv.TotalMass(MASS[:3], 1.0),), columns=COLUMNS).clauses
            ),
            "dm/dp has shape",
        ),
        (
            lambda: (
                cv.StepProblem(
                    constraints=(cv.TotalMass(0 * MASS, 1.0, 2.0),), columns=COLUMNS
                ).clauses
            ),
            "no parameter carries mass",
        ),
        (
            lambda: (
                cv.StepProblem(constraints=(cv.LinearEquality({}, 1.0),), columns=COLUMNS).clauses
            ),
            "names no parameter",
        ),
        (lambda: cv.solve_step(cv.StepProblem(columns=COLUMNS[::-1]), system()), "in order"),
        (
            lambda: cv.solve_step(
                cv.StepProblem(columns=COLUMNS), system(), cv.SolverChoice("MOSEQ")
            ),
            "installed are CLARABEL",
        ),
        (
            lambda: cv.solve_step(
                cv.StepProblem(constraints=CONSTRAINTS["norm"], columns=COLUMNS),
                system(),
                cv.SolverChoice("OSQP"),
            ),
            "OSQP cannot take the second-order cone of this step; choose CLARABEL or SCS",
        ),
        (
            lambda: cv.solve_step(
                cv.StepProblem(cv.AbsoluteLoss(), columns=COLUMNS),
                system(),
                cv.SolverChoice("quadprog"),
            ),
            "strictly convex",
        ),
        (lambda: cv.SolverChoice(tolerance=0.0), "between 0 and 1"),
        (lambda: cv.Huber(0.0), "above 0"),
        (lambda: cv.loss_named("l2"), "choose one of 'least-squares'"),
        (
            lambda: cv.solve_step(
                cv.StepProblem(
                    regularisers=(cv.GroupL1(1.0, (("a.E", "b.E"), ("a.E",))),), columns=COLUMNS
                ),
                system(),
            ),
            "two groups",
        ),
        (
            lambda: cv.CompiledStep(cv.StepProblem(columns=COLUMNS), 24).solve(
                system(), np.zeros(6), -1.0
            ),
            "radius 0 or more",
        ),
    ],
)
def test_faults_in_words(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_clauses_in_words():
    constraints = (
        cv.Bounds(
            np.array([-0.1, -np.inf, 0.2, -np.inf, 0, 0]),
            np.array([0.1, 0.3, np.inf, np.inf, 0, 1]),
        ),
        cv.Tied((("a.E", "b.E"),)),
        cv.TotalMass(MASS, 5.95),
        cv.TotalMass(MASS, 5.95, 6.0, 0.1),
        cv.LinearInequality({"a.E": 2.0, "b.E": -1.0}, upper=0.5),
        cv.LinearEquality({"c.k": 1.0}, 0.0, "c.k is held"),
    )
    names = [
        clause.name for clause in cv.StepProblem(constraints=constraints, columns=COLUMNS).clauses
    ]
    assert names == [
        "bounds on a.E: -0.1 to 0.1",
        "bounds on a.rho: at most 0.3",
        "bounds on b.E: at least 0.2",
        "bounds on c.k: held at 0",
        "bounds on d.m: 0 to 1",
        "tied: a.E = b.E",
        "total mass kept at 5.95 kg",
        "total mass set to 6 kg within 0.1 kg",
        "2 a.E - b.E at most 0.5",
        "c.k is held",
    ]


def test_the_package_does_not_load_cvxpy_and_neither_do_the_names_of_the_room():
    code = (
        "import sys, cvxupdate, cvxupdate.convex; print([m for m in ('cvxpy', 'clarabel', "
        "'osqp', 'qpsolvers') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
