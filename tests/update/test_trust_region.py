"""The loop itself, on residuals with closed forms."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import pytest

from cvxupdate.convex import L1, Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.errors import InputError, ModelError
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.trial import Trial, along_line
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
    return StepProblem(
        constraints=(Bounds(np.full(2, low), np.full(2, high)),),
        regularisers=regularisers,
        columns=("x", "y"),
    )


def run(
    residual: Curve, p0: tuple[float, float], step: StepProblem | None = None, **options: float
) -> LoopResult[CurvePoint]:
    return iterate(
        residual,
        step or problem(),
        SolverChoice(),
        Options(**{"max_iterations": 200, "tolerance": 1e-12, **options}),
        np.array(p0),
    )


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
    assert (
        stopped.status == "stopped"
        and "limit of 3 iterations" in stopped.reason
        and len(stopped.history) == 3
    )
    assert "meets the recordings" in run(Curve(), (1.0, 1.0)).reason
    bounded = run(Curve(), (-1.2, 1.0), problem(high=0.5))
    assert bounded.status == "converged" and "further decrease" in bounded.reason
    assert np.allclose(bounded.point.p, [0.5, 0.25], atol=1e-6)
    with pytest.raises(InputError, match="max_iterations"):
        run(Curve(), (-1.2, 1.0), max_iterations=0)


def test_contradicting_clauses_end_it_before_it_begins() -> None:
    low, high = (
        Bounds(np.array([0.5, -1.0]), np.array([1.0, 1.0])),
        Bounds(np.array([-1.0, -1.0]), np.array([0.4, 1.0])),
    )
    loop = run(Curve(), (0.0, 0.0), StepProblem(constraints=(low, high), columns=("x", "y")))
    assert loop.status == "infeasible" and len(loop.step.conflict) == 2 and not loop.history
    assert np.array_equal(loop.point.p, [0.0, 0.0])


def test_the_start_moves_to_the_nearest_point_that_is_allowed() -> None:
    loop = run(Curve(), (-7.0, 1.0))
    assert (
        np.array_equal(loop.start.p, [-7.0, 1.0])
        and loop.status == "converged"
        and np.allclose(loop.point.p, 1.0, atol=1e-6)
    )
    assert all(abs(x) <= 5.0 + 1e-7 for h in loop.history for x in h.p)


@pytest.mark.parametrize("regulariser", [Tikhonov(0.3), L1(0.3)])
def test_the_objective_counts_the_penalty(regulariser) -> None:
    step = problem(regularisers=(regulariser,))
    loop = run(Curve(), (-1.2, 1.0), step)
    best = objective_at(step, loop.point)
    assert best == pytest.approx(loop.history[-1].objective)
    rng = np.random.default_rng(0)
    assert all(
        objective_at(step, CurvePoint(loop.point.p + 1e-3 * rng.standard_normal(2))) >= best - 1e-9
        for _ in range(50)
    )


def test_progress_sees_every_iteration() -> None:
    seen: list[Iteration] = []
    loop = iterate(
        Curve(),
        problem(),
        SolverChoice(),
        Options(max_iterations=10),
        np.array([-1.2, 1.0]),
        seen.append,
    )
    assert tuple(seen) == loop.history and [h.number for h in seen] == list(range(1, len(seen) + 1))


# ── the forms of the iteration
# ───────────────────────────────────────────────────────────────────────────────────

FORMS = (
    {"line_search": True},
    {"second_order": True},
    {"line_search": True, "second_order": True},
    {"relative": (True, True)},
)


@pytest.mark.parametrize("form", FORMS, ids=str)
@pytest.mark.parametrize(
    "regularisers", [(), (L1(0.3),), (Tikhonov(0.3),)], ids=["none", "l1", "tikhonov"]
)
@pytest.mark.parametrize("high", [5.0, 0.5])
def test_every_form_ends_where_the_plain_loop_ends(form, regularisers, high) -> None:
    """Same minimum, inside the same bounds, and the objective never rises; from x > −1 so that the
    factor 1 + x is one."""
    step = problem(high=high, regularisers=regularisers)
    plain, loop = run(Curve(), (-0.5, 1.0), step), run(Curve(), (-0.5, 1.0), step, **form)
    assert loop.status == "converged" and loop.point.p == pytest.approx(plain.point.p, abs=1e-5)
    assert all(b.objective <= a.objective for a, b in itertools.pairwise(loop.history))
    assert all(max(h.p) <= high + 1e-7 for h in loop.history)
    assert all(h.step <= h.radius * (1.0 + 1e-6) for h in loop.history)


def test_second_order_terms_follow_the_valley() -> None:
    """Rosenbrock's residual is quadratic: the second-order term is all that the linearisation
    leaves out."""
    plain, curved = run(Curve(), (-1.2, 1.0)), run(Curve(), (-1.2, 1.0), second_order=True)
    assert len(curved.history) <= len(plain.history) // 2


def test_second_order_terms_cost_nothing_where_there_are_none() -> None:
    loop = iterate(
        Straight(),
        problem(),
        SolverChoice(),
        Options(tolerance=1e-12, radius=9.0, second_order=True),
        np.zeros(2),
    )
    assert (
        loop.status == "converged"
        and np.allclose(loop.point.p, [0.7, -0.4], atol=1e-8)
        and len(loop.history) <= 2
    )


def test_line_search_refuses_no_step() -> None:
    plain, searched = run(Curve(), (-1.2, 1.0)), run(Curve(), (-1.2, 1.0), line_search=True)
    assert any(not h.accepted for h in plain.history) and all(h.accepted for h in searched.history)
    assert len(searched.history) < len(plain.history)
    walled = run(Curve(wall=0.6), (-1.2, 1.0), line_search=True, max_iterations=60)
    assert all(h.p[0] <= 0.6 for h in walled.history) and any(
        h.accepted and h.ratio < 1.0 for h in walled.history
    )


def test_along_line_finds_the_minimum_of_a_parabola() -> None:
    def evaluate(p: Array) -> Trial[CurvePoint]:
        return Trial(CurvePoint(p), float((p[0] - 0.2) ** 2))

    start, end = np.zeros(2), np.array([1.0, 0.0])
    found = along_line(evaluate, start, end, 0.04, -0.4, evaluate(end))
    assert found.point is not None and found.point.p[0] == pytest.approx(0.2)
    nothing: Trial[CurvePoint] = Trial(None, np.inf)
    halved = along_line(
        lambda p: nothing if p[0] > 0.3 else evaluate(p), start, end, 0.04, -0.4, nothing
    )
    assert halved.point is not None and halved.point.p[0] == pytest.approx(
        0.2
    )  # half, a quarter, then the parabola
    never = along_line(lambda p: nothing, start, end, 0.04, -0.4, nothing)
    assert never.point is None


def test_multiplicative_steps_are_shares_of_the_present_factor() -> None:
    """No factor changes its sign however wide the trust region: 1 + p falls by 90 % a step at most,
    and grows by 90 %."""
    far = iterate(
        Straight(np.array([-0.999, 40.0])),
        problem(-5.0, 50.0),
        SolverChoice(),
        Options(1e-12, 60, 5.0, relative=(True, True)),
        np.zeros(2),
    )
    assert far.status == "converged" and np.allclose(far.point.p, [-0.999, 40.0], atol=1e-8)
    factors = np.array([[1.0, 1.0], *(1.0 + np.array(h.p) for h in far.history)])
    change = factors[1:] / factors[:-1]
    assert np.all(change > 0.1 - 1e-6) and np.all(change < 1.9 + 1e-6) and len(far.history) >= 5


@dataclass(frozen=True)
class Straight:
    """p − target: nothing is left out by its linearisation."""

    target: Array = field(default_factory=lambda: np.array([0.7, -0.4]))

    def evaluate(self, p: Array, before: StraightPoint | None = None) -> StraightPoint:
        del before
        return StraightPoint(np.asarray(p, dtype=float), self.target)


@dataclass(frozen=True)
class StraightPoint:
    p: Array
    target: Array

    @property
    def differences(self) -> tuple[Array, Array, tuple[str, ...]]:
        return self.p - self.target, np.ones(2), ("a", "b")

    def system(self) -> LinearSystem:
        return LinearSystem(np.eye(2), self.target, np.ones(2), ("x", "y"), ("a", "b"))
