"""Clusters of sensitivities, cut by the recordings' own deviations."""

from __future__ import annotations

import numpy as np

from cvxupdate.system import LinearSystem
from cvxupdate.update.grouping.clusters import clusters
from cvxupdate.update.grouping.seen import seen


def known(J: np.ndarray, p: np.ndarray, noise: float = 1.0):
    rng = np.random.default_rng(4)
    m, n = J.shape
    y = J @ p + noise * rng.standard_normal(m)
    names = tuple(f"p{k}" for k in range(n))
    system = LinearSystem(J, y, np.ones(m), names, tuple(map(str, range(m))))
    return seen(system, range(n), False)


def test_columns_that_no_recording_tells_apart_are_joined_and_no_others() -> None:
    rng = np.random.default_rng(0)
    J = 100.0 * rng.standard_normal((60, 4))
    J = np.column_stack([J, J[:, 0], J[:, 2] + 0.001 * rng.standard_normal(60)])
    found = clusters(known(J, np.zeros(6)), tuple((k,) for k in range(6)), [0] * 6, [0.1] * 6)
    assert found == ((0, 4), (1,), (2, 5), (3,))


def test_rows_are_never_mixed() -> None:
    J = 100.0 * np.random.default_rng(1).standard_normal((40, 2))[:, [0, 1, 0]]
    found = clusters(known(J, np.zeros(3)), ((0,), (1,), (2,)), [0, 0, 1], [0.1] * 3)
    assert all(2 not in g or g == (2,) for g in found)


def test_the_deviations_are_those_of_least_squares() -> None:
    J = np.random.default_rng(2).standard_normal((30, 3))
    it = known(J, np.zeros(3))
    A = np.column_stack([J[:, 0] + J[:, 2], J[:, 1]])
    expected = it.scatter * np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    assert np.allclose(it.deviations(((0, 2), (1,))), expected)
