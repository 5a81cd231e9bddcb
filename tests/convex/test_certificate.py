"""The certificate: right for the optimum of each kind of cone, and wrong for anything else."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate import convex as cv
from cvxupdate.convex.certificate import certify, farkas
from cvxupdate.convex.cones import dual_violation, matrix_of, primal_violation
from cvxupdate.convex.eliminate import eliminate
from cvxupdate.convex.matrix_form import Cones, cone_program
from cvxupdate.convex.solvers import SolverChoice, solver_named
from cvxupdate.convex.solvers.scs import lower_triangle_order

from ..cases.convex_cases import COLUMNS, system


def programs():
    """One program per kind of cone, its known optimum where there is one."""
    rng = np.random.default_rng(5)
    x = cp.Variable(3)
    X = cp.Variable((3, 3), symmetric=True)
    S = np.array([[2.0, 1.0, -0.5], [1.0, -1.0, 0.3], [-0.5, 0.3, 0.4]])
    w = np.linalg.eigvalsh(S)
    projected = float(np.sum(w[w < 0] ** 2))
    c = np.array([0.3, -0.2, 0.5])
    A = rng.normal(size=(5, 3))
    b = rng.normal(size=5)
    best = np.linalg.lstsq(A, b, rcond=None)[0]
    return {
        "quadratic": (
            cp.Problem(cp.Minimize(cp.sum_squares(A @ x - b) + 7.0)),
            float(np.sum((A @ best - b) ** 2)) + 7.0,
        ),
        "linear": (
            cp.Problem(cp.Minimize(c @ x), [x >= -1, x <= 2, cp.sum(x) == 1]),
            -0.2 * 2 - 0.3 * 0 - 0.5 * 1,
        ),
        "soc": (cp.Problem(cp.Minimize(c @ x), [cp.norm(x) <= 2]), -2 * float(np.linalg.norm(c))),
        "psd": (cp.Problem(cp.Minimize(cp.sum_squares(X - S)), [X >> 0]), projected),
        "exp": (cp.Problem(cp.Minimize(cp.sum(cp.exp(x)) - cp.sum(x))), 3.0),
    }


@pytest.mark.parametrize("solver", ["CLARABEL", "SCS"])
@pytest.mark.parametrize("kind", list(programs()))
def test_optimum_of_each_cone_is_certified(kind, solver):
    problem, value = programs()[kind]
    program, _ = cone_program(problem)
    raw = solver_named(solver).solve(program, SolverChoice(solver))
    assert certify(program, raw.x, raw.s, raw.z).is_optimal(1e-7)
    if kind == "linear":
        value = float(problem.solve(solver=cp.HIGHS))
    assert program.objective(raw.x) == pytest.approx(value, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("kind", list(programs()))
def test_a_point_that_is_not_optimal_is_not_certified(kind):
    program, _ = cone_program(programs()[kind][0])
    raw = solver_named("CLARABEL").solve(program, SolverChoice())
    rng = np.random.default_rng(0)
    for size in (1e-3, 1e-1):
        moved = raw.x + size * rng.normal(size=raw.x.size)
        assert not certify(program, moved, program.b - program.A @ moved, raw.z).is_optimal(1e-6)
        if raw.z.size:
            assert not certify(
                program, raw.x, raw.s, raw.z + size * rng.normal(size=raw.z.size)
            ).is_optimal(1e-6)
    assert not certify(program, raw.x * np.nan, raw.s, raw.z).is_optimal(1e9)


def test_each_residual_sees_its_own_fault():
    problem = cv.StepProblem(constraints=(cv.Bounds(-0.1, 0.1),), columns=COLUMNS)
    from cvxupdate.convex.problem import compile_step

    model = compile_step(problem, 24, box=False)
    R, d, _ = problem.loss.reduce(*system().weighted())
    model.set_data(R, d, ())
    program, _ = cone_program(model.problem)
    raw = solver_named("CLARABEL").solve(program, SolverChoice())
    good = certify(program, raw.x, raw.s, raw.z)
    assert good.is_optimal(1e-8) and good.as_dict()["gap"] == good.gap
    inside = np.arange(program.b.size) >= program.cones.zero
    assert certify(program, raw.x, raw.s + 1.0 * inside, raw.z).primal > 1e-4
    assert (
        certify(
            program, raw.x, raw.s, raw.z + 100.0 * (np.arange(program.b.size) == program.cones.zero)
        ).dual
        > 1e-6
    )
    assert certify(program, raw.x, -raw.s - 1.0, raw.z).primal_cone > 1e-4
    assert certify(program, raw.x, raw.s, -raw.z).dual_cone > 1e-4


def test_cone_membership():
    cones = Cones(zero=1, nonneg=2, soc=(3,), psd=(2,), exp=1)
    psd = np.array([2.0, np.sqrt(2) * 1.0, 1.0])
    inside = np.concatenate([[0.0], [1.0, 0.0], [5.0, 3.0, 4.0], psd, [1.0, 2.0, 2 * np.exp(0.5)]])
    assert primal_violation(inside, cones) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(matrix_of(psd), [[2.0, 1.0], [1.0, 1.0]])
    for place, step in ((0, 0.1), (2, -0.1), (3, -0.1), (8, -1.0), (11, -0.1)):
        outside = inside.copy()
        outside[place] += step
        assert primal_violation(outside, cones) > 0.05
    # u = -1, v = -1: -u exp(v/u) = e <= e w needs w >= 1.
    dual = np.concatenate([[-9.0], [1.0, 0.0], [5.0, 3.0, 4.0], psd, [-1.0, -1.0, 1.0]])
    assert dual_violation(dual, cones) == pytest.approx(0.0, abs=1e-12)
    assert dual_violation(dual - np.eye(12)[11] * 0.1, cones) == pytest.approx(0.1)


def test_triangle_order_of_scs():
    order = lower_triangle_order(Cones(psd=(3,)))
    S = np.array([[1.0, 2, 3], [2, 4, 5], [3, 5, 6]])
    upper_by_columns = np.concatenate([S[: j + 1, j] for j in range(3)])
    lower_by_columns = np.concatenate([S[j:, j] for j in range(3)])
    np.testing.assert_array_equal(upper_by_columns[order], lower_by_columns)


def test_elimination_keeps_the_optimum_and_restores_the_dual():
    from cvxupdate.convex.problem import compile_step

    problem = cv.StepProblem(
        regularisers=(cv.L1(40.0), cv.Tikhonov(3.0)),
        constraints=(cv.Bounds(-0.1, 0.1),),
        columns=COLUMNS,
    )
    model = compile_step(problem, 24, box=False)
    R, d, _ = problem.loss.reduce(*system().weighted())
    model.set_data(R, d, (40.0, 3.0))
    program, _ = cone_program(model.problem)
    reduced = eliminate(program)
    assert reduced.small.q.size < program.q.size and reduced.small.cones.zero == 0
    raw = solver_named("CLARABEL").solve(reduced.small, SolverChoice())
    x, z = reduced.restore(raw.x, raw.z)
    assert program.objective(x) == pytest.approx(reduced.small.objective(raw.x), rel=1e-12)
    assert certify(program, x, program.b - program.A @ x, z).is_optimal(1e-7)


def test_farkas_tells_a_proof_from_a_claim():
    from cvxupdate.convex.matrix_form import ConeProgram

    A = sp.csc_array(np.array([[1.0], [-1.0]]))
    program = ConeProgram(
        sp.csc_array((1, 1)), np.zeros(1), A, np.array([0.0, -1.0]), Cones(nonneg=2)
    )
    assert farkas(program, np.array([3.0, 3.0])).proves()
    for claim in ([3.0, 1.0], [-3.0, -3.0], [0.0, 0.0], [np.nan, 1.0]):
        assert not farkas(program, np.array(claim)).proves()
    feasible = ConeProgram(program.P, program.q, A, np.array([1.0, -0.5]), program.cones)
    assert not farkas(feasible, np.array([1.0, 1.0])).proves()


def _lmi(columns):
    """F0 + Σ p F_i ⪰ 0 as a clause, as issue 6 will add it: the interface must carry it."""
    rng = np.random.default_rng(2)
    F = [np.diag([1.0, 0.6, 0.8])] + [(M + M.T) for M in rng.normal(size=(len(columns), 3, 3))]

    def matrix(p):
        return F[0] + sum(p[i] * F[i + 1] for i in range(len(columns)))

    return cv.ConicClause(
        "the mass matrix is positive semidefinite",
        lambda p, slack: [matrix(p) + slack * np.eye(3) >> 0],
        lambda p: float(np.linalg.eigvalsh(matrix(p))[0]),
    )


class Given:
    """A constraint made of given clauses."""

    def __init__(self, *clauses):
        self.given = clauses

    def clauses(self, columns):
        return self.given


def test_a_matrix_inequality_is_a_clause_like_any_other():
    lmi = _lmi(COLUMNS)
    problem = cv.StepProblem(constraints=(Given(lmi), cv.Bounds(-1.0, 1.0)), columns=COLUMNS)
    free = cv.solve_step(
        cv.StepProblem(constraints=(cv.Bounds(-1.0, 1.0),), columns=COLUMNS), system(seed=6)
    )
    assert lmi.margin(free.p) < -0.01
    rows = {row.solver: row for row in cv.compare_solvers(problem, system(seed=6))}
    assert rows["CLARABEL"].status == rows["SCS"].status == "optimal"
    assert rows["SCS"].objective == pytest.approx(rows["CLARABEL"].objective, rel=1e-6)
    assert "semidefinite cone" in rows["OSQP"].note
    step = cv.solve_step(problem, system(seed=6))
    assert lmi.margin(step.p) > -1e-7 and lmi.name in step.active
    clash = (
        Given(lmi),
        cv.LinearEquality({name: 1.0 for name in COLUMNS}, 20.0),
        cv.Bounds(-2.0, 3.5),
    )
    infeasible = cv.solve_step(cv.StepProblem(constraints=clash, columns=COLUMNS), system())
    if infeasible.status == "infeasible":
        assert lmi.name in infeasible.conflict and infeasible.infeasibility.proves()
    assert infeasible.status == "infeasible"


def test_an_exponential_cone_is_a_clause_like_any_other():
    """Entropy: Σ x log x ≤ budget, x = p + 1; checked by a grid of its Lagrangian."""

    def margin(p):
        return 0.02 - float(np.sum((p + 1) * np.log(p + 1) - p))

    clause = cv.ConicClause(
        "entropy at most 0.02",
        lambda p, slack: [cp.sum(-cp.entr(p + 1) - p) <= 0.02 + slack],
        margin,
    )
    problem = cv.StepProblem(constraints=(Given(clause),), columns=COLUMNS)
    step = cv.solve_step(problem, system())
    assert step.status == "optimal"
    assert margin(step.p) == pytest.approx(0.0, abs=1e-7)
    WA, Wb = system().weighted()
    gradient, normal = 2 * WA.T @ (WA @ step.p - Wb), np.log(step.p + 1)
    multiplier = -(gradient @ normal) / (normal @ normal)
    assert multiplier > 0
    np.testing.assert_allclose(gradient, -multiplier * normal, atol=1e-5 * np.linalg.norm(gradient))
    rows = {
        row.solver: row
        for row in cv.compare_solvers(problem, system(), ["CLARABEL", "SCS", "DAQP"])
    }
    assert rows["SCS"].objective == pytest.approx(rows["CLARABEL"].objective, rel=1e-6)
    assert rows["DAQP"].note == "DAQP cannot take the exponential cone"
