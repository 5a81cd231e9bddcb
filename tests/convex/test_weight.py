"""The weight by L-curve, generalised cross-validation and discrepancy."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import convex as cv
from cvxupdate.convex.regularisers.common import null_space
from cvxupdate.convex.weight import curvature
from cvxupdate.errors import InputError
from cvxupdate.system import LinearSystem

from ..cases.convex_cases import COLUMNS, system


def smoothing(
    noise: float = 1e-3, n: int = 16, rows: int = 40, seed: int = 0
) -> tuple[LinearSystem, np.ndarray]:
    """A blurred, badly conditioned system with a known smooth truth."""
    s, t = np.linspace(0, 1, rows), np.linspace(0, 1, n)
    A = np.exp(-0.5 * ((s[:, None] - t[None, :]) / 0.12) ** 2) / n * 4
    truth = 0.3 * np.sin(np.pi * t) + 0.1 * np.cos(3 * np.pi * t)
    b = A @ truth + noise * np.random.default_rng(seed).normal(size=rows)
    columns = tuple(f"e{i}.E" for i in range(n))
    return LinearSystem(
        A, b, np.full(rows, 1 / noise), columns, tuple(map(str, range(rows)))
    ), truth


def ridge(data: LinearSystem, weight: float) -> np.ndarray:
    WA, Wb = data.weighted()
    return np.linalg.solve(WA.T @ WA + weight * np.eye(WA.shape[1]), WA.T @ Wb)


def test_gcv_is_the_minimum_of_its_closed_form():
    data, truth = smoothing()
    choice = cv.choose_weight(
        cv.StepProblem(regularisers=(cv.Tikhonov("gcv"),), columns=data.columns), data, "gcv"
    )
    WA, Wb = data.weighted()
    m = len(Wb)
    for weight, loss, _, score in choice.curve[::4]:
        influence = WA @ np.linalg.solve(WA.T @ WA + weight * np.eye(WA.shape[1]), WA.T)
        residual = WA @ ridge(data, weight) - Wb
        assert loss == pytest.approx(residual @ residual, rel=1e-5)
        assert score == pytest.approx(
            m * (residual @ residual) / (m - np.trace(influence)) ** 2, rel=1e-5
        )
    assert choice.weight == choice.curve[np.argmin(choice.curve[:, 3]), 0]
    error = [np.linalg.norm(ridge(data, w) - truth) for w in choice.curve[:, 0]]
    assert np.linalg.norm(ridge(data, choice.weight) - truth) < 3 * min(error)


@pytest.mark.parametrize("seed", range(4))
def test_the_l_curve_corner_lies_between_signal_and_noise(seed):
    """Six directions carry the signal, ten only noise, at singular values 1e5 apart: the weight
    must part them."""
    rng = np.random.default_rng(seed)
    U, V = np.linalg.qr(rng.normal(size=(40, 16)))[0], np.linalg.qr(rng.normal(size=(16, 16)))[0]
    sigma = np.concatenate([np.linspace(1.0, 0.5, 6), np.linspace(2e-5, 5e-6, 10)])
    truth = V[:, :6] @ rng.choice([-0.3, 0.3], 6)
    b = U @ (sigma * (V.T @ truth)) + 1e-3 * rng.normal(size=40)
    columns = tuple(f"e{i}.E" for i in range(16))
    data = LinearSystem((U * sigma) @ V.T, b, np.full(40, 1e3), columns, tuple(map(str, range(40))))
    chosen, choice = cv.with_chosen_weight(
        cv.StepProblem(regularisers=(cv.Tikhonov("l-curve"),), columns=columns), data
    )
    assert choice is not None and choice.note == ""
    assert (10 * 2e-5 * 1e3) ** 2 < choice.weight < (0.1 * 0.5 * 1e3) ** 2
    assert chosen.weights == (choice.weight,)
    assert np.linalg.norm(ridge(data, choice.weight) - truth) < 0.02


def test_the_l_curve_tames_a_blurred_system():
    for seed in range(3):
        data, truth = smoothing(seed=seed)
        problem = cv.StepProblem(regularisers=(cv.Tikhonov("l-curve"),), columns=data.columns)
        choice = cv.choose_weight(problem, data, "l-curve")
        plain = np.linalg.norm(ridge(data, choice.curve[0, 0]) - truth)
        found = np.linalg.norm(ridge(data, choice.weight) - truth)
        assert plain > 50
        assert found < 0.002 * plain
        np.testing.assert_allclose(
            cv.solve_step(problem, data).p, ridge(data, choice.weight), atol=1e-5
        )


def test_discrepancy_meets_the_number_of_rows():
    data, _ = smoothing()
    for regulariser in (
        cv.Tikhonov("discrepancy"),
        cv.L1("discrepancy"),
        cv.GroupL1("discrepancy"),
    ):
        problem = cv.StepProblem(
            regularisers=(regulariser,), constraints=(cv.Bounds(-1.0, 1.0),), columns=data.columns
        )
        chosen, choice = cv.with_chosen_weight(problem, data)
        assert choice is not None and choice.note == ""
        step = cv.solve_step(chosen, data)
        residual = data.residual(step.p)
        assert residual @ residual == pytest.approx(len(data.rows), rel=2e-3)


def test_discrepancy_says_when_the_deviations_cannot_be_met():
    data = system(outliers=3)
    choice = cv.choose_weight(
        cv.StepProblem(regularisers=(cv.Tikhonov(1.0),), columns=COLUMNS), data, "discrepancy"
    )
    assert "no weight brings the residual down" in choice.note
    assert choice.weight == choice.curve[0, 0]
    still = LinearSystem(data.A, np.zeros(24), data.weights, data.columns, data.rows)
    choice = cv.choose_weight(
        cv.StepProblem(regularisers=(cv.Tikhonov(1.0),), columns=COLUMNS), still, "discrepancy"
    )
    assert "already agree" in choice.note


def test_l1_with_gcv_finds_the_few_that_moved():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(60, 20))
    truth = np.zeros(20)
    truth[[3, 11, 17]] = [-0.3, 0.2, 0.25]
    data = LinearSystem(
        A,
        A @ truth + 0.01 * rng.normal(size=60),
        np.full(60, 100.0),
        tuple(f"e{i}.E" for i in range(20)),
        tuple(map(str, range(60))),
    )
    for rule in ("gcv", "l-curve"):
        step = cv.solve_step(
            cv.StepProblem(regularisers=(cv.L1(rule),), columns=data.columns), data
        )
        largest = set(np.argsort(-np.abs(step.p))[:3].tolist())
        assert largest == {3, 11, 17}
        assert np.max(np.abs(step.p - truth)) < 0.03


def test_degrees_of_freedom_within_constraints():
    data = system(outliers=0)
    WA, _ = data.weighted()
    active = np.array([[1.0, 0, -1, 0, 0, 0], [0, 1, 1, 0, 0, 0.5]])
    scale, weight = np.linspace(0.5, 2, 6), 30.0
    Z = null_space(active, 6)
    assert np.abs(active @ Z).max() < 1e-14 and Z.shape == (6, 4)
    H = (
        WA
        @ Z
        @ np.linalg.solve(Z.T @ WA.T @ WA @ Z + weight * Z.T @ np.diag(scale**-2.0) @ Z, Z.T @ WA.T)
    )
    found = cv.Tikhonov(1.0, scale=scale).degrees_of_freedom(
        WA, np.zeros(6), weight, active, COLUMNS
    )
    assert found == pytest.approx(np.trace(H), rel=1e-9)
    p = np.array([0.1, 0.0, 0.1, 0.2, 0.0, 0.3])
    assert cv.L1(1.0).degrees_of_freedom(WA, p, 1.0, active[:1], COLUMNS) == 3
    assert cv.GroupL1(1.0).degrees_of_freedom(WA, p, 1.0, np.zeros((0, 6)), COLUMNS) == 5


def test_curvature_of_a_circle():
    t = np.linspace(0, 2, 400)
    bend = curvature(3 * np.cos(t), 3 * np.sin(t), 0.3)
    np.testing.assert_allclose(bend[25:-25], 1 / 3, rtol=1e-3)
    assert np.isnan(bend[0]) and np.isnan(bend[-1])
    np.testing.assert_allclose(
        curvature(3 * np.cos(-t), 3 * np.sin(-t), 0.3)[25:-25], -1 / 3, rtol=1e-3
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: cv.choose_weight(cv.StepProblem(columns=COLUMNS), system(), "gcv"),
            "needs a regulariser",
        ),
        (
            lambda: cv.choose_weight(
                cv.StepProblem(regularisers=(cv.L1(1.0),), columns=COLUMNS), system(), "best"
            ),
            "not known",
        ),
        (
            lambda: cv.choose_weight(
                cv.StepProblem(cv.Huber(), (cv.L1(1.0),), (), COLUMNS), system(), "gcv"
            ),
            "least-squares loss only",
        ),
        (
            lambda: cv.choose_weight(
                cv.StepProblem(regularisers=(cv.L1("gcv"), cv.Tikhonov("gcv")), columns=COLUMNS),
                system(),
                "gcv",
            ),
            "only one regulariser",
        ),
        (lambda: cv.L1("best"), "neither a number"),
        (lambda: cv.Tikhonov(-1.0), "0 or more"),
        (
            lambda: cv.CompiledStep(
                cv.StepProblem(regularisers=(cv.L1("gcv"),), columns=COLUMNS), 24
            ).solve(system()),
            "still the rule",
        ),
    ],
)
def test_faults_in_words(make, words):
    with pytest.raises(InputError, match=words):
        make()
