"""Weighted sums of matrices are what they are one by one, wherever weights are zero."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.synthesis.sums import Sums, summed


def symmetric(rng: np.random.Generator, n: int, r: int) -> np.ndarray:
    A = rng.standard_normal((n, r, r))
    return A + np.swapaxes(A, 1, 2)


@pytest.mark.parametrize("k", [0, 2])
@pytest.mark.parametrize("live", [[], [0], [3, 4, 5], [0, 1, 9, 30], list(range(31))])
def test_a_weighted_sum_is_that_of_its_terms(live: list[int], k: int) -> None:
    rng = np.random.default_rng(len(live) + k)
    whole = symmetric(rng, 31, 5 + k)
    further = whole[:, :, 5:] if k else None
    weights = np.zeros(31)
    weights[live] = rng.standard_normal(len(live))
    out = np.ones((5 + k, 5 + k))
    Sums(whole[:, :5, :5], further).add(out, weights)
    np.testing.assert_allclose(out, 1.0 + np.einsum("n,nij->ij", weights, whole), atol=1e-12)


def test_elements_are_summed_in_the_shapes() -> None:
    rng = np.random.default_rng(1)
    T, V = symmetric(rng, 4, 3), rng.standard_normal((4, 3, 6))
    true = np.einsum("eir,eij,ejs->rs", V, T, V)
    np.testing.assert_allclose(summed(T, V), true, atol=1e-12)
    np.testing.assert_allclose(summed(T, V, 2), true[:, 4:], atol=1e-12)
    assert not np.any(summed(0.0 * T, V))
