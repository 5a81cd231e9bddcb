"""Sparse factors: solutions, inertia, singular matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.errors import ModelError
from cvxupdate.fe.factor import factorise
from tests.cases.elements import build, grid


def stiffness() -> tuple[sp.csc_array, sp.csc_array, np.ndarray]:
    m = build(grid(np.linspace(0, 0.5, 7), np.linspace(0, 0.3, 5))).matrices()
    import scipy.linalg as la

    return m.K, m.M, la.eigvalsh(m.K.toarray(), m.M.toarray())


K, M, VALUES = stiffness()


@settings(max_examples=30, deadline=None)
@given(st.floats(0.02, 0.98), st.integers(3, 60))
def test_inertia_counts_eigenvalues(share: float, i: int) -> None:
    """Sylvester: the negative pivots of K − μ M are the eigenvalues below μ, wherever μ falls
    between two of them."""
    below, above = VALUES[i - 1], VALUES[i]
    if i == 3:
        below = 0.0
    if above - below < 1e-4 * above:
        return
    assert factorise(K - (below + share * (above - below)) * M).negatives() == i


def test_solutions_real_and_complex() -> None:
    rng = np.random.default_rng(1)
    b = rng.standard_normal((K.shape[0], 3))
    A = K + 1e5 * M
    assert np.allclose(A @ factorise(A).solve(b), b, atol=1e-7)
    assert np.allclose(A @ factorise(A).solve(b[:, 0]), b[:, 0], atol=1e-7)
    Z = K * (1 + 0.02j) - 4e4 * M
    assert np.allclose(Z @ factorise(Z).solve(b + 1j), b + 1j, atol=1e-7)


def test_saddle_point_needs_pivots() -> None:
    A = sp.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    assert np.allclose(factorise(A, pivot=True).solve(np.array([2.0, 3.0])), [3.0, 2.0])
    assert factorise(A).negatives() is None  # rows had to be exchanged: no count


def test_singular_matrix_is_refused() -> None:
    with pytest.raises(ModelError, match="the dynamic stiffness is singular.*mechanism"):
        factorise(sp.csc_array(np.array([[1.0, -1.0], [-1.0, 1.0]])), "the dynamic stiffness")
