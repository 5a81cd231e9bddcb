"""The classical solvers against closed forms and one another; the classical iterations on equations
whose answer is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.errors import InputError
from cvxupdate.system import LinearSystem
from cvxupdate.update.classic_solvers import (
    conjugate_gradients,
    landweber,
    picard,
    svd_least_squares,
    tikhonov,
    total_least_squares,
)
from validation.studies.classic_loop import classic_loop


def problem(m=20, n=6, seed=0, noise=0.0):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((m, n))
    p = rng.uniform(-1, 1, n)
    return A, A @ p + noise * rng.standard_normal(m), p


def test_svd_least_squares_and_truncation():
    A, b, _ = problem(noise=0.1)
    assert svd_least_squares(A, b) == pytest.approx(np.linalg.lstsq(A, b, rcond=None)[0], abs=1e-12)
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    for level in range(1, 7):
        kept = svd_least_squares(A, b, level)
        assert Vt[level:] @ kept == pytest.approx(0.0, abs=1e-12)
        assert U[:, :level].T @ (A @ kept - b) == pytest.approx(0.0, abs=1e-12)
    assert s[0] > s[-1]
    with pytest.raises(InputError, match="keeps nothing"):
        svd_least_squares(A, b, 0)


def test_tikhonov_is_equation_4_7_and_its_limits():
    A, b, _ = problem(noise=0.1)
    n = A.shape[1]
    start = np.linspace(-0.1, 0.2, n)
    for alpha in (1e-3, 1.0, 50.0):
        direct = np.linalg.solve(A.T @ A + alpha * np.eye(n), A.T @ b + alpha * start)
        assert tikhonov(A, b, alpha, start) == pytest.approx(direct, abs=1e-10)
    assert tikhonov(A, b, 1e-12) == pytest.approx(svd_least_squares(A, b), abs=1e-8)
    assert tikhonov(A, b, 1e12, start) == pytest.approx(start, abs=1e-9)


def test_picard_counts_the_terms_above_the_noise():
    rng = np.random.default_rng(2)
    U = np.linalg.qr(rng.standard_normal((60, 20)))[0]
    V = np.linalg.qr(rng.standard_normal((20, 20)))[0]
    s = 10.0 ** -np.arange(20)
    A = U * s @ V.T
    found = picard(A, A @ V @ np.ones(20) + 1e-6 * rng.standard_normal(60))
    assert 5 <= found.level <= 8  # the coefficients are 10^-i against 1e-6
    assert found.singular == pytest.approx(s, rel=1e-6, abs=1e-14)


def test_total_least_squares_is_the_smallest_singular_vector():
    A, b, p = problem(noise=0.05)
    got = total_least_squares(A, b)
    smallest = np.linalg.svd(np.column_stack([A, b]))[2][-1]
    assert got.p == pytest.approx(-smallest[:-1] / smallest[-1], abs=1e-10)
    # its corrected system is consistent, and no smaller correction is: the correction's norm is
    # σ_{n+1}
    z = np.append(got.p, -1.0)
    correction = -np.outer(np.column_stack([A, b]) @ z, z) / (z @ z)
    assert np.linalg.norm(correction) == pytest.approx(got.singular[-1], rel=1e-9)
    exact = total_least_squares(*problem(noise=0.0)[:2])
    assert exact.p == pytest.approx(p, abs=1e-9)


def test_total_least_squares_weights_and_rank():
    A, b, _ = problem(noise=0.05)
    D, T = np.linspace(0.5, 2.0, 20), np.linspace(1.5, 0.6, 7)
    weighted = total_least_squares(A, b, D, T)
    plain = total_least_squares(D[:, None] * A * T[:6], D * b * T[6])
    assert weighted.p == pytest.approx(T[:6] * plain.p / T[6], abs=1e-10)
    # T tells that A is exact: least squares
    trusted = total_least_squares(A, b, None, np.append(np.full(6, 1e6), 1.0))
    assert trusted.p == pytest.approx(svd_least_squares(A, b), abs=1e-6)
    # a column that is a copy within the noise lowers the rank, and the minimum-norm solution shares
    # its weight
    rng = np.random.default_rng(3)
    twin = np.column_stack([A, A[:, 0]]) + 1e-6 * rng.standard_normal((20, 7))
    exact = twin @ np.append(np.ones(6), 1.0) + 1e-6 * rng.standard_normal(20)
    low = total_least_squares(twin, exact, noise=1e-6)
    assert low.rank == 6
    assert low.p == pytest.approx(np.ones(7), abs=1e-3)
    with pytest.raises(InputError, match="above 0"):
        total_least_squares(A, b, np.zeros(20))
    with pytest.raises(InputError, match="no rank"):
        total_least_squares(np.eye(4)[:, :2], np.eye(4)[:, 3] * 10, epsilon=1.0 + 1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), m=st.integers(5, 30))
def test_iterative_solvers_reach_least_squares(seed, m):
    rng = np.random.default_rng(seed)
    U = np.linalg.qr(rng.standard_normal((m, 4)))[0]
    A = U @ np.diag(rng.uniform(0.5, 1.0, 4)) @ np.linalg.qr(rng.standard_normal((4, 4)))[0]
    b = rng.standard_normal(m)
    best = svd_least_squares(A, b)
    cg = conjugate_gradients(A, b)
    assert cg.p == pytest.approx(best, abs=1e-7) and np.all(np.diff(cg.residual) <= 1e-12)
    assert landweber(A, b, 400).p == pytest.approx(best, abs=1e-7)


def test_stopping_early_regularises():
    """With an ill-conditioned A the discrepancy stop beats the end of the iteration, for both."""
    rng = np.random.default_rng(5)
    U = np.linalg.qr(rng.standard_normal((40, 12)))[0]
    V = np.linalg.qr(rng.standard_normal((12, 12)))[0]
    A = U * 10.0 ** -np.linspace(0, 4, 12) @ V.T
    truth = V[:, :4] @ np.ones(4)
    noise = 1e-3
    error = noise * rng.standard_normal(40)
    b, target = A @ truth + error, 1.02 * np.linalg.norm(error)
    naive = np.linalg.norm(svd_least_squares(A, b) - truth)
    for found in (
        conjugate_gradients(A, b, discrepancy=target),
        landweber(A, b, 20000, discrepancy=target),
    ):
        assert np.linalg.norm(found.p - truth) < 0.2 * naive
    with pytest.raises(InputError, match="between 0 and 2"):
        landweber(A, b, relaxation=2.0)


@dataclass(frozen=True)
class Curve:
    """r = a·(q − target) + bend·(q − target)² in the factors q = 1 + p, component by component."""

    p: np.ndarray
    target: np.ndarray
    bend: float

    @property
    def differences(self):
        d = self.p - self.target
        return d + self.bend * d**2, np.ones(len(d)), tuple("ab")

    def system(self):
        A = np.diag(1.0 + 2.0 * self.bend * (self.p - self.target))
        return LinearSystem(A, A @ self.p - self.differences[0], np.ones(2), ("a", "b"), ("a", "b"))


@pytest.mark.parametrize("form", ["additive", "multiplicative"])
@pytest.mark.parametrize("extra", [{}, {"line_search": True}, {"second_order": True}])
def test_every_form_of_the_iteration_reaches_the_root(form, extra):
    target = np.array([0.3, -0.2])
    found = classic_loop(
        lambda p: Curve(p, target, 0.8), np.zeros(2), form, tolerance=1e-10, **extra
    )
    assert found.converged and found.p == pytest.approx(target, abs=1e-9)


def test_second_order_terms_and_line_search_pay():
    target = np.array([0.5, -0.4])
    runs = [
        classic_loop(
            lambda p: Curve(p, target, 0.6), np.zeros(2), tolerance=1e-10, **extra
        ).iterations
        for extra in ({}, {"second_order": True})
    ]
    assert runs[1] < runs[0]

    # a step that overshoots diverges from far away without a line search, not with one
    def steep(p):
        return Steep(p)

    assert not classic_loop(steep, np.full(2, 3.0), max_iterations=50).converged
    assert classic_loop(
        steep, np.full(2, 3.0), max_iterations=50, line_search=True
    ).p == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(ValueError, match="neither"):
        classic_loop(steep, np.zeros(2), "both")


@dataclass(frozen=True)
class Steep:
    p: np.ndarray

    @property
    def differences(self):
        return np.arctan(self.p), np.ones(len(self.p)), ("a", "b")

    def system(self):
        A = np.diag(1.0 / (1.0 + self.p**2))
        return LinearSystem(A, A @ self.p - np.arctan(self.p), np.ones(2), ("a", "b"), ("a", "b"))
