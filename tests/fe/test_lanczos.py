"""Block Lanczos: the largest eigenvalues of K⁻¹M, against LAPACK's."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la

from cvxupdate.errors import ModelError
from cvxupdate.fe.lanczos import largest_eigenvalues


def pencil(theta, rng, massless=0):
    """K, M (N, N) whose K⁻¹M has the eigenvalues ``theta`` and ``massless`` zeros."""
    size = len(theta) + massless
    # of condition 100, as stiffness and mass of a mesh have directions of their own
    inverse = la.qr(rng.standard_normal((size, size)))[0] * np.geomspace(1.0, 0.01, size)
    K = inverse.T @ np.diag(np.append(np.sign(theta), np.ones(massless))) @ inverse
    M = inverse.T @ np.diag(np.append(np.abs(theta), np.zeros(massless))) @ inverse
    return (K + K.T) / 2, (M + M.T) / 2


def found(K, M, count, together=4):
    lu = la.lu_factor(K)
    return largest_eigenvalues(
        lambda b: la.lu_solve(lu, b), lambda x: M @ x, len(K), count, together
    )


@pytest.mark.parametrize("together", [1, 3, 4])
@pytest.mark.parametrize("massless", [0, 40])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_values_and_vectors(together, massless, sign):
    theta = 1.0 / np.arange(1.0, 161.0) ** 2
    theta[[0, 3]] *= sign  # K of two negative eigenvalues
    K, M = pencil(theta, np.random.default_rng(together), massless)
    values, x = found(K, M, 12, together)
    assert np.allclose(values, theta[:12], rtol=1e-9)
    assert np.allclose(x.T @ M @ x, np.eye(12), atol=1e-9)
    assert np.allclose(x.T @ K @ x, np.diag(1.0 / values), rtol=1e-6, atol=1e-6)


def test_every_copy_of_an_eigenvalue_repeated_as_often_as_the_block_is_wide():
    theta = np.concatenate([np.full(4, 1.0), np.full(3, 0.5), 0.3 / np.arange(1.0, 100.0)])
    values, _ = found(*pencil(theta, np.random.default_rng(0)), 9)
    assert np.allclose(values, theta[:9], rtol=1e-9)


def test_an_invariant_space_is_gone_beyond():
    """Two different eigenvalues, each repeated often: every block leaves an invariant space."""
    theta = np.repeat([1.0, 0.5], [7, 30])
    values, _ = found(*pencil(theta, np.random.default_rng(1), 20), 12)
    assert set(np.round(values, 9)) == {1.0, 0.5}
    assert len(values) == 12


def test_fewer_where_there_are_no_more():
    theta = np.array([1.0, 0.5, 0.2, 0.1, 0.05])
    values, x = found(*pencil(theta, np.random.default_rng(2), 30), 9)
    assert np.allclose(values, theta, rtol=1e-9)
    assert x.shape == (35, 5)


def test_nearly_all_of_a_small_one():
    theta = 1.0 / np.arange(1.0, 31.0)
    values, _ = found(*pencil(theta, np.random.default_rng(5)), 25)
    assert np.allclose(values, theta[:25], rtol=1e-9)


def test_a_basis_that_is_full_is_reduced(monkeypatch):
    """Eigenvalues that lie close together take more columns than the basis may have."""
    from cvxupdate.fe import lanczos

    theta = 1.0 - np.linspace(0.0, 0.2, 300)
    monkeypatch.setattr(lanczos, "WIDE", 2)
    restarts = []
    original = lanczos._Lanczos.restart
    monkeypatch.setattr(
        lanczos._Lanczos, "restart", lambda self: (restarts.append(1), original(self))
    )
    values, _ = found(*pencil(theta, np.random.default_rng(3)), 6)
    assert len(restarts) > 1
    assert np.allclose(values, theta[:6], rtol=1e-9)


def test_nothing_converges(monkeypatch):
    from cvxupdate.fe import lanczos

    monkeypatch.setattr(lanczos, "ACCURACY", 0.0)
    monkeypatch.setattr(lanczos, "RESTARTS", 2)
    with pytest.raises(ModelError, match="did not converge"):
        found(*pencil(1.0 / np.arange(1.0, 201.0), np.random.default_rng(4)), 5)
