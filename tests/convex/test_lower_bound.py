"""Convex lower bounds of bilinear least squares: below every point, exact where the terms are
linear, and closed by splitting where they are not."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.convex.lower_bound import CLOSE, GlobalBound, global_bound, too_large
from cvxupdate.convex.moments import Moments, Term, term

LOOSE = 4  # a seed whose first relaxation leaves a gap
LOWER, UPPER = np.array([-0.6, -0.4]), np.array([0.8, 1.1])


def terms(seed: int, products: float = 1.0) -> tuple[Term, ...]:
    """Two terms of five rows, two parameters and one unknown each."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(2):
        shapes = ((5,), (5, 2), (5, 1), (2, 5, 1))
        a, A, B, C = (rng.standard_normal(s) for s in shapes)
        out.append(term(a, A, B, products * C, np.array([3.0])))
    return tuple(out)


def values(every: tuple[Term, ...], points: np.ndarray) -> np.ndarray:
    """The sum at each of ``points`` (m, 2), the one unknown of each term eliminated."""
    total = np.zeros(len(points))
    ones = np.column_stack([np.ones(len(points)), points])
    for t in every:
        rows = np.einsum("rji,mj->mri", t.triangle.reshape(len(t.triangle), 3, -1), ones)
        a, b = rows[:, :, 0], rows[:, :, 1]
        total += np.sum(a**2, axis=1) - np.sum(a * b, axis=1) ** 2 / np.sum(b**2, axis=1)
    return total


def value(every: tuple[Term, ...], x: np.ndarray) -> float:
    """The sum at one point."""
    return float(values(every, x[None])[0])


def grid(every: tuple[Term, ...], n: int = 81) -> tuple[float, np.ndarray]:
    """The least of many points of the box."""
    axes = [np.linspace(a, b, n) for a, b in zip(LOWER, UPPER, strict=True)]
    points = np.array(np.meshgrid(*axes)).reshape(2, -1).T
    all_ = values(every, points)
    return float(all_.min()), points[int(np.argmin(all_))]


def found(every: tuple[Term, ...], p: np.ndarray, boxes: int = 200) -> GlobalBound:
    return global_bound(every, LOWER, UPPER, p, lambda x: value(every, x), boxes)


@pytest.mark.parametrize("seed", range(2))
def test_bound_lies_below_every_point_and_branching_closes_the_gap(seed: int) -> None:
    every = terms(seed)
    least, where = grid(every)
    root = Moments(every, 2).bound(LOWER, UPPER, 1e3)
    assert root.lower <= least
    bound = found(every, where)
    assert bound.lower <= least and bound.best <= least
    assert bound.optimal and bound.gap <= CLOSE * bound.best


def test_a_start_in_another_valley_is_told() -> None:
    """From the worst corner of the box the search still ends at the global minimum."""
    every = terms(1)
    least, _ = grid(every)
    corner = max(
        (np.array([a, b]) for a in (LOWER[0], UPPER[0]) for b in (LOWER[1], UPPER[1])),
        key=lambda x: value(every, x),
    )
    assert value(every, corner) > 1.5 * least
    bound = found(every, corner)
    assert bound.best <= least * (1.0 + 2.0 * CLOSE)
    assert value(every, bound.p) == pytest.approx(bound.best)


def test_linear_terms_are_bounded_exactly_in_one_program() -> None:
    """Without products the bound is the minimum of linear least squares with bounds."""
    from scipy.optimize import lsq_linear

    rng = np.random.default_rng(3)
    a, A = rng.standard_normal(6), rng.standard_normal((6, 2))
    exact = lsq_linear(A, -a, (LOWER, UPPER))
    none = np.zeros((6, 0))
    every = (term(a, A, none, np.zeros((2, 6, 0)), np.zeros(0)),)
    bound = global_bound(every, LOWER, UPPER, exact.x, lambda x: float(np.sum((a + A @ x) ** 2)))
    assert bound.boxes == 1
    assert bound.lower == pytest.approx(2.0 * exact.cost, rel=1e-6)


def test_parts_of_a_box_are_bounded_no_lower_than_the_whole() -> None:
    every = terms(2)
    program = Moments(every, 2)
    whole = program.bound(LOWER, UPPER, 1e3).lower
    cut = 0.3
    left = program.bound(LOWER, np.array([cut, UPPER[1]]), 1e3).lower
    right = program.bound(np.array([cut, LOWER[1]]), UPPER, 1e3).lower
    assert min(left, right) >= whole - 1e-6 * max(1.0, whole)


def test_few_programs_say_how_large_the_gap_still_is() -> None:
    """Stopped early the bound holds all the same, and more programs raise it."""
    every = terms(LOOSE, 3.0)
    least, _ = grid(every)
    first, later = (found(every, np.zeros(2), boxes=n) for n in (1, 9))
    assert first.boxes == 1 and not first.optimal
    assert first.lower < later.lower <= least


def test_too_large_a_program_is_not_begun() -> None:
    assert too_large(4, [1, 1]) is None
    assert too_large(17, [888]) == 18 * 889
