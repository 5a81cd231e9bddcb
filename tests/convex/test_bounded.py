"""Least squares within bounds by an active set: the minimum that Clarabel finds, proved."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.convex import (
    Bounds,
    CompiledStep,
    SolverChoice,
    StepProblem,
    Tikhonov,
)
from cvxupdate.convex.bounded import Limits, limits_of, minimised, quadratic_of
from cvxupdate.convex.step import DIRECT
from cvxupdate.system import LinearSystem

from ..cases.convex_cases import CASE_COLUMNS, COLUMNS, CONSTRAINTS

DRAWS = 40


def rows_of(A: np.ndarray, b: np.ndarray, columns: tuple[str, ...]) -> LinearSystem:
    """Rows of unit weight."""
    return LinearSystem(A, b, np.ones(len(b)), columns, tuple(f"row {k}" for k in range(len(b))))


def drawn(seed: int) -> tuple[StepProblem, LinearSystem, np.ndarray, np.ndarray | None]:
    """A problem of up to a dozen parameters whose sizes span six decades, some bounds open, some
    reached; where it begins, and its trust region."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 13))
    columns = tuple(f"p{k}" for k in range(n))
    size = 10.0 ** rng.uniform(-3.0, 3.0, n)
    A = rng.standard_normal((int(rng.integers(1, 40)), n)) / size
    truth = size * rng.standard_normal(n)
    b = A @ truth + 0.1 * rng.standard_normal(len(A))
    lower = np.where(rng.random(n) < 0.3, -np.inf, -0.5 * size)
    upper = np.where(rng.random(n) < 0.3, np.inf, 0.5 * size)
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.1 * size, 10.0 * size),),
        constraints=(Bounds(lower, upper),),
        columns=columns,
    )
    centre = np.clip(0.1 * truth, lower, upper)
    radius = None if seed % 3 == 0 else np.where(rng.random(n) < 0.2, np.inf, 0.3 * size)
    return problem, rows_of(A, b, columns), centre, radius


@pytest.mark.parametrize("seed", range(DRAWS))
def test_same_minimum_as_clarabel(seed: int) -> None:
    problem, system, centre, radius = drawn(seed)
    rows = len(system.rows)
    direct = CompiledStep(problem, rows, SolverChoice(direct=True))
    ours = direct.solve(system, centre, radius)
    theirs = CompiledStep(problem, rows, SolverChoice(tolerance=1e-11)).solve(
        system, centre, radius
    )
    assert ours.solver == DIRECT and theirs.solver == "CLARABEL"
    assert ours.certificate.worst < 1e-12
    assert ours.objective <= theirs.objective * (1.0 + 1e-9)
    scale = np.maximum(np.abs(theirs.p), 1e-3 * np.abs(theirs.p).max())
    assert np.abs(ours.p - theirs.p) == pytest.approx(0.0, abs=1e-4 * scale.max())
    limits = limits_of(problem)
    assert limits is not None
    if radius is not None:
        limits = limits.within(centre, radius)
    assert np.all((limits.lower <= ours.p) & (ours.p <= limits.upper))
    assert set(ours.active) == set(theirs.active)


def test_most_of_the_draws_reach_their_bounds() -> None:
    """What the draws above would show of free minima alone is little."""
    reached = sum(
        any(
            name.startswith("bounds")
            for name in CompiledStep(p, 40, SolverChoice(direct=True)).solve(s, c, r).active
        )
        for p, s, c, r in map(drawn, range(DRAWS))
    )
    assert reached > DRAWS / 2


def test_a_parameter_that_may_not_move_stays() -> None:
    problem, system, centre, _ = drawn(3)
    radius = np.zeros(len(centre))
    step = CompiledStep(problem, len(system.rows), SolverChoice(direct=True)).solve(
        system, centre, radius
    )
    assert step.solver == DIRECT
    assert step.p == pytest.approx(centre, abs=0.0)


def test_bounds_that_exclude_each_other_are_explained_by_the_solver() -> None:
    problem, system, centre, _ = drawn(4)
    far = centre + 1e6 * (1.0 + np.abs(centre))
    step = CompiledStep(problem, len(system.rows), SolverChoice(direct=True)).solve(
        system, far, np.full(len(far), 1e-3)
    )
    assert step.status == "infeasible" and step.conflict


def test_rows_that_say_nothing_go_to_the_solver() -> None:
    """Without a curvature there is no one minimum."""
    problem, system, _, _ = drawn(5)
    quadratic = quadratic_of(problem, 0.0 * system.A, system.b, (0.0,))
    n = len(problem.columns)
    assert minimised(quadratic, Limits(np.full(n, -1.0), np.full(n, 1.0))) is None


def test_other_clauses_are_none_of_its_business() -> None:
    """Of all constraints that there are it takes bounds, by whatever name, and no others."""
    term = (Tikhonov(1.0),)
    takes = {
        name
        for name, case in CONSTRAINTS.items()
        if limits_of(
            StepProblem(
                regularisers=term, constraints=case, columns=CASE_COLUMNS.get(name, COLUMNS)
            )
        )
    }
    assert takes == {"none", "bounds", "connectivity", "element mass"}
