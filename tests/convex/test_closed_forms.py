"""The step against closed forms and other people's algorithms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, linprog, lsq_linear

from cvxupdate import convex as cv
from cvxupdate.system import LinearSystem

from ..cases.convex_cases import COLUMNS, MASS, system


def orthonormal(n: int = 6, rows: int = 30, seed: int = 1) -> LinearSystem:
    rng = np.random.default_rng(seed)
    A = np.linalg.qr(rng.normal(size=(rows, n)))[0]
    b = A @ rng.uniform(-1, 1, n) + 0.05 * rng.normal(size=rows)
    return LinearSystem(A, b, np.ones(rows), COLUMNS[:n], tuple(map(str, range(rows))))


def step_of(data, regularisers=(), constraints=(), loss=None):
    step = cv.solve_step(
        cv.StepProblem(loss or cv.LeastSquares(), regularisers, constraints, data.columns), data
    )
    assert step.status == "optimal"
    return step


@settings(max_examples=12, deadline=None)
@given(weight=st.floats(1e-2, 1e6), seed=st.integers(0, 50), rows=st.integers(3, 40))
def test_ridge(weight, seed, rows):
    data = system(rows=rows, seed=seed)
    reference, scale = np.linspace(-0.1, 0.1, 6), np.linspace(0.5, 2.0, 6)
    WA, Wb = data.weighted()
    stacked = np.vstack([WA, np.sqrt(weight) * np.diag(1 / scale)])
    right = np.concatenate([Wb, np.sqrt(weight) * reference / scale])
    exact = np.linalg.lstsq(stacked, right, rcond=None)[0]
    step = step_of(data, (cv.Tikhonov(weight, reference, scale),))
    best = np.sum((stacked @ exact - right) ** 2)
    assert step.objective == pytest.approx(best, rel=1e-7, abs=1e-6)
    if rows >= 12:
        np.testing.assert_allclose(step.p, exact, atol=1e-6)


@pytest.mark.parametrize("rows", [4, 7, 24, 400])
def test_bounded_least_squares_against_scipy(rows):
    data = system(rows=rows)
    WA, Wb = data.weighted()
    other = lsq_linear(WA, Wb, (-0.1, 0.12), method="bvls", tol=1e-14)
    step = step_of(data, constraints=(cv.Bounds(-0.1, 0.12),))
    assert step.objective == pytest.approx(2 * other.cost, rel=1e-8, abs=1e-6)
    if rows >= 7:
        np.testing.assert_allclose(step.p, other.x, atol=1e-6)
        at_bound = {
            f"bounds on {name}: -0.1 to 0.12"
            for name, side in zip(COLUMNS, other.active_mask, strict=True)
            if side
        }
        assert set(step.active) == at_bound


def test_soft_threshold():
    data = orthonormal()
    weight = 1.0
    z = data.A.T @ data.b
    exact = np.sign(z) * np.maximum(np.abs(z) - weight / 2, 0)
    assert np.any(exact == 0) and np.any(exact != 0)
    np.testing.assert_allclose(step_of(data, (cv.L1(weight),)).p, exact, atol=1e-7)


def test_group_soft_threshold():
    data = orthonormal()
    groups = (("a.E", "a.rho"), ("b.E",), ("b.rho", "c.k", "d.m"))
    weight = 0.9
    z = data.A.T @ data.b
    exact = np.zeros(6)
    for places in ([0, 1], [2], [3, 4, 5]):
        size = np.linalg.norm(z[places])
        exact[places] = max(0.0, 1 - weight * np.sqrt(len(places)) / 2 / size) * z[places]
    np.testing.assert_allclose(step_of(data, (cv.GroupL1(weight, groups),)).p, exact, atol=1e-6)


def test_one_norm_of_a_constant_is_the_weighted_median():
    values = np.array([0.1, 0.2, 0.25, 0.7, 5.0, -3.0, 0.3])
    weights = np.array([1.0, 2.0, 1.5, 1.0, 4.0, 0.5, 1.1])
    data = LinearSystem(np.ones((7, 1)), values, weights, ("p",), tuple("abcdefg"))
    order = np.argsort(values)
    median = values[order][np.searchsorted(np.cumsum(weights[order]), weights.sum() / 2)]
    assert step_of(data, loss=cv.AbsoluteLoss()).p[0] == pytest.approx(median, abs=1e-7)


def test_one_norm_against_a_linear_program():
    data = system()
    WA, Wb = data.weighted()
    m, n = WA.shape
    other = linprog(
        np.r_[np.zeros(n), np.ones(m)],
        np.block([[WA, -np.eye(m)], [-WA, -np.eye(m)]]),
        np.r_[Wb, -Wb],
        bounds=[(-0.2, 0.2)] * n + [(0, None)] * m,
    )
    step = step_of(data, constraints=(cv.Bounds(-0.2, 0.2),), loss=cv.AbsoluteLoss())
    assert step.objective == pytest.approx(other.fun, rel=1e-8)


def test_huber_against_iteratively_reweighted_least_squares():
    data = system()
    WA, Wb = data.weighted()
    p = np.linalg.lstsq(WA, Wb, rcond=None)[0]
    for _ in range(400):
        w = np.minimum(1.0, 1.345 / np.maximum(np.abs(WA @ p - Wb), 1e-300))
        p = np.linalg.lstsq(np.sqrt(w)[:, None] * WA, np.sqrt(w) * Wb, rcond=None)[0]
    step = step_of(data, loss=cv.Huber())
    np.testing.assert_allclose(step.p, p, atol=1e-6)
    plain = step_of(data).p
    clean = system(outliers=0)
    truth = step_of(clean).p
    assert np.linalg.norm(step.p - truth) < 0.5 * np.linalg.norm(plain - truth)


def test_huber_with_a_wide_threshold_is_least_squares():
    data = system()
    assert step_of(data, loss=cv.Huber(1e4)).objective == pytest.approx(
        step_of(data).objective, rel=1e-8
    )


def test_equality_constrained_least_squares_against_its_kkt_matrix():
    data = system()
    WA, Wb = data.weighted()
    C = np.vstack([MASS, [1, 0, -1, 0, 0, 0]])
    K = np.block([[2 * WA.T @ WA, C.T], [C, np.zeros((2, 2))]])
    exact = np.linalg.solve(K, np.r_[2 * WA.T @ Wb, 0.3, 0.0])[:6]
    constraints = (cv.TotalMass(MASS, base=5.95, value=6.25), cv.Tied((("a.E", "b.E"),)))
    step = step_of(data, constraints=constraints)
    np.testing.assert_allclose(step.p, exact, atol=1e-7)
    assert set(step.active) == {"total mass set to 6.25 kg", "tied: a.E = b.E"}


def test_projection_on_a_ball_and_on_a_plane():
    ball = cv.StepProblem(
        constraints=(cv.NormAtMost(np.eye(6), np.zeros(6), 0.5, "ball"),), columns=COLUMNS
    )
    p = np.array([1.0, -2.0, 0.5, 0.0, 0.3, 1.5])
    near = cv.CompiledStep(ball, 6).nearest(p)
    np.testing.assert_allclose(near.p, 0.5 * p / np.linalg.norm(p), atol=1e-7)
    assert near.objective == pytest.approx((np.linalg.norm(p) - 0.5) ** 2, rel=1e-6)
    plane = cv.StepProblem(constraints=(cv.TotalMass(MASS, base=1.0),), columns=COLUMNS)
    np.testing.assert_allclose(
        cv.CompiledStep(plane, 6).nearest(p).p, p - MASS * (MASS @ p) / (MASS @ MASS), atol=1e-7
    )


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), radius=st.floats(1e-3, 10))
def test_trust_region_of_a_separable_problem_clips(seed, radius):
    data = orthonormal(seed=seed)
    centre = np.random.default_rng(seed).uniform(-0.5, 0.5, 6)
    exact = np.clip(data.A.T @ data.b, centre - radius, centre + radius)
    problem = cv.StepProblem(columns=COLUMNS)
    step = cv.CompiledStep(problem, 30).solve(data, centre, radius)
    np.testing.assert_allclose(step.p, exact, atol=1e-7)


def test_rank_deficient_data_still_reach_the_least_residual():
    data = system()
    A = data.A.copy()
    A[:, 3] = 2 * A[:, 1]
    flat = LinearSystem(A, data.b, data.weights, data.columns, data.rows)
    WA, Wb = flat.weighted()
    best = np.sum((WA @ np.linalg.lstsq(WA, Wb, rcond=None)[0] - Wb) ** 2)
    assert step_of(flat, constraints=(cv.Bounds(-5, 5),)).objective == pytest.approx(best, rel=1e-8)


def test_badly_scaled_rows_and_columns():
    """Weights over eight decades and columns over six: still the optimum of a general optimiser's
    problem, certified."""
    data = system(outliers=0)
    scale = np.geomspace(1e-3, 1e3, 6)
    weights = data.weights * np.geomspace(1e-4, 1e4, 24)
    wild = LinearSystem(data.A * scale, data.b, weights, data.columns, data.rows)
    bounds = cv.Bounds(-0.2 / scale, 0.2 / scale)
    step = step_of(wild, constraints=(bounds,))
    tame = LinearSystem(data.A, data.b, weights, data.columns, data.rows)
    WA, Wb = tame.weighted()
    other = lsq_linear(WA, Wb, (-0.2, 0.2), method="bvls", tol=1e-14)
    assert step.objective == pytest.approx(2 * other.cost, rel=1e-6)


def test_least_squares_in_an_ellipsoid_against_its_secular_equation():
    data = system()
    WA, Wb = data.weighted()
    F, g, radius = np.diag(MASS + 1), np.full(6, 0.05), 0.3

    def at(multiplier):
        return np.linalg.solve(WA.T @ WA + multiplier * F.T @ F, WA.T @ Wb + multiplier * F.T @ g)

    root = brentq(lambda m: np.linalg.norm(F @ at(np.exp(m)) - g) - radius, -10, 30, xtol=1e-14)
    exact = at(np.exp(root))
    step = step_of(data, constraints=(cv.NormAtMost(F, g, radius, "budget"),))
    np.testing.assert_allclose(step.p, exact, atol=1e-6)
    assert step.objective == pytest.approx(np.sum((WA @ exact - Wb) ** 2), rel=1e-7)
    assert step.active == ("budget",)
