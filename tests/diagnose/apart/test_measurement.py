"""Separations by their definition."""

import numpy as np
import pytest

from cvxupdate.diagnose.apart.measurement import (
    Measurement,
    pairs_of,
    ranked,
    root_of_covariance,
    separation,
)


@pytest.mark.parametrize("share", [1.0, 0.3])
def test_a_separation_is_that_of_the_whole_covariance(share: float) -> None:
    rng = np.random.default_rng(1)
    gap, spread = rng.standard_normal(12), rng.standard_normal((12, 4))
    C = np.eye(12) / share + spread @ spread.T
    assert separation(gap, spread, share) == pytest.approx(np.sqrt(gap @ np.linalg.solve(C, gap)))


def test_what_the_unknowns_may_take_up_tells_nothing() -> None:
    rng = np.random.default_rng(2)
    spread = rng.standard_normal((9, 2))
    gap = spread @ np.array([0.7, -1.1])
    assert separation(gap, 1e6 * spread) < 1e-5
    assert separation(gap, 1e-9 * spread) == pytest.approx(np.linalg.norm(gap))


@pytest.mark.parametrize("share", [1.0, 0.2])
def test_the_root_is_that_of_the_covariance(share: float) -> None:
    rng = np.random.default_rng(3)
    A, scales = rng.standard_normal((30, 5)), np.array([0.1, 1.0, 3.0, 0.02, 10.0])
    L = root_of_covariance(A, scales, share)
    P = np.linalg.inv(share * A.T @ A + np.diag(1.0 / scales**2))
    assert np.allclose(L @ L.T, P, rtol=1e-9, atol=1e-12 * P.max())


def test_pairs_that_are_told_for_good_count_no_more() -> None:
    sure = Measurement("response", "one pair for good", (90.0, 0.0, 0.0))
    all_ = Measurement("response", "all three", (4.0, 3.5, 4.0))
    assert len(pairs_of(3)) == 3
    assert ranked([sure, all_])[0] is all_
    assert all_.least == 3.5
