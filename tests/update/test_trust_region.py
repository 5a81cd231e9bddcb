"""The loop itself, on residuals with closed forms."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

from cvxupdate.convex import L1, Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.errors import InputError, ModelError
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at


@dataclass(frozen=True)
class Curve:
    """Rosenbrock's valley as a residual (10 (y − x²), 1 − x); no structure where x > ``wall``."""

    wall: float = np.inf

    def evaluate(self, p: Array, before: CurvePoint | None = None) -> CurvePoint:
        del before
        if p[0] > self.wall:
            raise ModelError("beyond the wall")
        return CurvePoint(np.asarray(p, dtype=float))


@dataclass(frozen=True)
class CurvePoint:
    p: Array

    @property
    def differences(self) -> tuple[Array, Array, tuple[str, ...]]:
        x, y = self.p
        return np.array([10.0 * (y - x * x), 1.0 - x]), np.ones(2), ("a", "b")

    def system(self) -> LinearSystem:
        A = np.array([[-20.0 * self.p[0], 10.0], [-1.0, 0.0]])
        values, weights, rows = self.differences
        return LinearSystem(A, A @ self.p - values, weights, ("x", "y"), rows)


def problem(low: float = -5.0, high: float = 5.0, regularisers: tuple = ()) -> StepProblem:
    return StepProblem(constraints=(Bounds(np.full(2, low), np.full(2, high)),), regularisers=regularisers, columns=("x", "y"))


def run(residual: Curve, p0: tuple[float, float], step: StepProblem | None = None, **options: float) -> LoopResult[CurvePoint]:
    return iterate(residual, step or problem(), SolverChoice(), Options(**{"max_iterations": 200, "tolerance": 1e-12, **options}), np.array(p0))


def test_a_curved_valley_is_followed_to_its_end() -> None:
    loop = run(Curve(), (-1.2, 1.0))
    assert loop.status == "converged" and np.allclose(loop.point.p, 1.0, atol=1e-7)
    accepted = [h.objective for h in loop.history]
    assert all(b <= a for a, b in itertools.pairwise(accepted))
    assert any(not h.accepted for h in loop.history)  # the valley bends: some steps must be refused


def test_radius_follows_the_ratio() -> None:
    history = run(Curve(), (-1.2, 1.0)).history
    for h, after in itertools.pairwise(history):
        if h.ratio < 0.25:
            assert after.radius == pytest.approx(0.25 * h.step)
        elif h.ratio > 0.75 and h.step > 0.99 * h.radius:
            assert after.radius == pytest.approx(2.0 * h.radius)
        else:
            assert after.radius == h.radius
        assert h.step <= h.radius * (1.0 + 1e-6)


def test_no_structure_there_means_a_shorter_step() -> None:
    loop = run(Curve(wall=0.6), (-1.2, 1.0))
    assert loop.point.p[0] <= 0.6
    assert any(h.ratio == -np.inf and not h.accepted for h in loop.history)
    assert all(h.p[0] <= 0.6 for h in loop.history)


def test_no_structure_at_the_start_is_an_error() -> None:
    with pytest.raises(ModelError, match="wall"):
        run(Curve(wall=-2.0), (-1.2, 1.0))


def test_stopping_reasons() -> None:
    stopped = run(Curve(), (-1.2, 1.0), max_iterations=3)
    assert stopped.status == "stopped" and "limit of 3 iterations" in stopped.reason and len(stopped.history) == 3
    assert "meets the recordings" in run(Curve(), (1.0, 1.0)).reason
    bounded = run(Curve(), (-1.2, 1.0), problem(high=0.5))
    assert bounded.status == "converged" and "further decrease" in bounded.reason
    assert np.allclose(bounded.point.p, [0.5, 0.25], atol=1e-6)
    with pytest.raises(InputError, match="max_iterations"):
        run(Curve(), (-1.2, 1.0), max_iterations=0)


def test_contradicting_clauses_end_it_before_it_begins() -> None:
    low, high = Bounds(np.array([0.5, -1.0]), np.array([1.0, 1.0])), Bounds(np.array([-1.0, -1.0]), np.array([0.4, 1.0]))
    loop = run(Curve(), (0.0, 0.0), StepProblem(constraints=(low, high), columns=("x", "y")))
    assert loop.status == "infeasible" and len(loop.step.conflict) == 2 and not loop.history
    assert np.array_equal(loop.point.p, [0.0, 0.0])


def test_the_start_moves_to_the_nearest_point_that_is_allowed() -> None:
    loop = run(Curve(), (-7.0, 1.0))
    assert np.array_equal(loop.start.p, [-7.0, 1.0]) and loop.status == "converged" and np.allclose(loop.point.p, 1.0, atol=1e-6)
    assert all(abs(x) <= 5.0 + 1e-7 for h in loop.history for x in h.p)


@pytest.mark.parametrize("regulariser", [Tikhonov(0.3), L1(0.3)])
def test_the_objective_counts_the_penalty(regulariser) -> None:
    step = problem(regularisers=(regulariser,))
    loop = run(Curve(), (-1.2, 1.0), step)
    best = objective_at(step, loop.point)
    assert best == pytest.approx(loop.history[-1].objective)
    rng = np.random.default_rng(0)
    assert all(objective_at(step, CurvePoint(loop.point.p + 1e-3 * rng.standard_normal(2))) >= best - 1e-9 for _ in range(50))


def test_progress_sees_every_iteration() -> None:
    seen: list[Iteration] = []
    loop = iterate(Curve(), problem(), SolverChoice(), Options(max_iterations=10), np.array([-1.2, 1.0]), seen.append)
    assert tuple(seen) == loop.history and [h.number for h in seen] == list(range(1, len(seen) + 1))
