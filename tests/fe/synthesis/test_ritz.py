"""Modes of a space: those of the whole where it is whole; none where shapes are alike."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.synthesis.ritz import ritz


def test_modes_of_a_space():
    rng = np.random.default_rng(7)
    A, B = rng.standard_normal((2, 6, 6))
    K, M = sp.csc_array(A @ A.T + np.eye(6)), sp.csc_array(B @ B.T + np.eye(6))
    V = rng.standard_normal((6, 6))
    X = ritz(V, K, M)
    np.testing.assert_allclose(X.T @ (M @ X), np.eye(6), atol=1e-9)
    values = la.eigh(K.toarray(), M.toarray(), eigvals_only=True)
    np.testing.assert_allclose(np.diag(X.T @ (K @ X)), values, rtol=1e-9)
    assert ritz(V[:, [0, 1, 1]], K, -1.0 * M) is None
