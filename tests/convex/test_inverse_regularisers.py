"""Entropy, total variation and worst-case least squares: solved alike by every solver that can, and
what their theory says of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from cvxupdate import convex as cv
from cvxupdate.errors import InputError
from cvxupdate.system import LinearSystem

from ..cases.convex_cases import COLUMNS, CONSTRAINTS, system
from .tolerances import TOLERANCES

PAIRS = (("a.E", "b.E"), ("a.rho", "b.rho"), ("b.E", "c.k"))
CASES = {
    "total-variation": (cv.LeastSquares(), cv.TotalVariation(40.0, PAIRS)),
    "entropy": (cv.LeastSquares(), cv.Entropy(300.0, reference=0.02)),
    "robust": (cv.Norm(), cv.Robust(20.0)),
    "robust with l1": (cv.Norm(), cv.L1(3.0)),
}
LINEAR = {"total-variation"}
CONES = {"CLARABEL", "SCS"}


@pytest.mark.parametrize("constraint", ["none", "bounds", "tied", "several"])
@pytest.mark.parametrize("case", CASES)
def test_every_capable_solver_reaches_the_certified_optimum(case, constraint):
    loss, regulariser = CASES[case]
    problem = cv.StepProblem(loss, (regulariser,), CONSTRAINTS[constraint], COLUMNS)
    rows = {row.solver: row for row in cv.compare_solvers(problem, system())}
    best = rows["CLARABEL"].objective
    for name, row in rows.items():
        if (case not in LINEAR and name not in CONES) or name == "QUADPROG":
            assert row.status == "refused", row
            continue
        allowed = TOLERANCES[name]
        assert row.status == "optimal", row
        assert row.objective == pytest.approx(best, rel=allowed.objective), name
        assert row.certificate.is_optimal(allowed.certificate), (name, row.certificate)


@pytest.mark.parametrize("case", CASES)
def test_value_is_the_expression_and_no_point_is_better(case):
    loss, regulariser = CASES[case]
    problem = cv.StepProblem(loss, (regulariser,), (), COLUMNS)
    data = system()
    step = cv.solve_step(problem, data)
    rng = np.random.default_rng(1)
    import cvxpy as cp

    for _ in range(10):
        p = rng.uniform(-0.4, 0.4, 6)
        v = cp.Variable(6, value=p)
        assert float(regulariser.expression(v, COLUMNS).value) == pytest.approx(
            regulariser.value(p, COLUMNS), rel=1e-9
        )
        assert problem.objective(data, step.p + 1e-3 * p) >= step.objective * (1 - 1e-9)


def test_worst_case_least_squares_is_the_worst_case():
    """max over ‖[ΔA Δb]‖_F ≤ ρ is attained by the rank-one error along the residual (El Ghaoui and
    Lebret), and no draw exceeds it."""
    data = system()
    A, b = data.weighted()
    rho = 20.0
    step = cv.solve_step(cv.StepProblem(cv.Norm(), (cv.Robust(rho),), (), COLUMNS), data)
    r = A @ step.p - b
    z = np.append(step.p, -1.0)
    worst = rho * np.outer(r / np.linalg.norm(r), z / np.linalg.norm(z))
    stacked = np.column_stack([A, b])
    assert np.linalg.norm((stacked + worst) @ z) == pytest.approx(step.objective, rel=1e-9)
    rng = np.random.default_rng(0)
    for _ in range(200):
        e = rng.standard_normal(stacked.shape)
        assert np.linalg.norm((stacked + rho * e / np.linalg.norm(e)) @ z) <= step.objective * (
            1 + 1e-12
        )


def test_norm_keeps_the_part_that_no_parameter_reaches():
    data = system()
    R, d, constant = cv.Norm().reduce(*data.weighted())
    assert constant == 0.0 and R.shape == (7, 6)
    p = np.linspace(-0.2, 0.3, 6)
    assert np.linalg.norm(R @ p - d) == pytest.approx(np.linalg.norm(data.residual(p)), rel=1e-12)


def test_total_variation_finds_the_patch():
    """A piecewise constant change of 12 elements in a row comes back with one edge, where least
    squares scatters."""
    rng = np.random.default_rng(4)
    names = tuple(f"e{i}.stiffness" for i in range(12))
    truth = np.where(np.arange(12) < 5, -0.2, 0.1)
    A = rng.standard_normal((14, 12)) @ np.diag(np.geomspace(1, 0.05, 12))
    data = LinearSystem(
        A,
        A @ truth + 0.02 * rng.standard_normal(14),
        np.full(14, 50.0),
        names,
        tuple(map(str, range(14))),
    )
    pairs = tuple(pairwise(names))
    chosen = cv.solve_step(
        cv.StepProblem(cv.LeastSquares(), (cv.TotalVariation("discrepancy", pairs),), (), names),
        data,
    )
    plain = cv.solve_step(cv.StepProblem(cv.LeastSquares(), (), (), names), data)
    assert np.linalg.norm(chosen.p - truth) < 0.7 * np.linalg.norm(plain.p - truth)
    jumps, scatter = np.abs(np.diff(chosen.p)), np.abs(np.diff(plain.p))
    assert jumps[4] > 0.2 and np.delete(jumps, 4).max() < 0.01 < 0.1 < np.delete(scatter, 4).max()


def test_entropy_keeps_factors_positive_and_prefers_none():
    names = COLUMNS
    data = LinearSystem(np.eye(6), np.full(6, -1.5), np.ones(6), names, tuple(map(str, range(6))))
    step = cv.solve_step(cv.StepProblem(cv.LeastSquares(), (cv.Entropy(0.5),), (), names), data)
    assert step.status == "optimal" and np.all(step.p > -1.0) and np.all(step.p < -0.8)
    assert step.p == pytest.approx(
        brentq(lambda p: 2 * (p + 1.5) + 0.5 * np.log1p(p), -0.999, 0.0), abs=1e-5
    )  # stationary
    assert cv.Entropy(1.0).value(np.zeros(6), names) == 0.0


@pytest.mark.parametrize("rule", ["l-curve", "gcv", "discrepancy"])
@pytest.mark.parametrize("kind", ["total-variation", "entropy"])
def test_weight_rules(kind, rule):
    made = cv.TotalVariation(rule, PAIRS) if kind == "total-variation" else cv.Entropy(rule)
    step = cv.solve_step(
        cv.StepProblem(cv.LeastSquares(), (made,), (), COLUMNS), system(outliers=0)
    )
    assert step.status == "optimal"


def test_messages():
    with pytest.raises(InputError, match="no two parameters are neighbours"):
        cv.TotalVariation(1.0, ())
    with pytest.raises(InputError, match="above −1"):
        cv.Entropy(1.0, reference=-1.0)
