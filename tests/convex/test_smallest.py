"""The smallest eigenvalue by sparse factors against LAPACK, definite, semidefinite and indefinite,
and against closed forms where LAPACK is too slow."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.convex import smallest_eigenvalue
from cvxupdate.convex.smallest import ACCURACY


@pytest.mark.parametrize("shift", [1.0, 0.0, -0.3, -3.0])
def test_against_lapack(shift):
    rng = np.random.default_rng(4)
    A = sp.random_array((700, 700), density=0.004, rng=rng)
    A = sp.csc_array(A @ A.T + shift * sp.eye_array(700))
    true = np.linalg.eigvalsh(A.toarray())[0]
    # many eigenvalues of A Aᵀ are nearly 0: a cluster, where λ − σ is at most ten times the
    # negative |λ|
    assert smallest_eigenvalue(A) == pytest.approx(true, abs=max(1e-14, -10 * ACCURACY * true))


def test_one_negative_eigenvalue_among_thousands_is_found():
    """A free chain of 20 000 masses has the eigenvalue 0; a spring of negative stiffness at one
    place makes exactly one negative one."""
    n = 20_000
    main, off = np.full(n, 2.0), np.full(n - 1, -1.0)
    main[0] = main[-1] = 1.0
    free = sp.diags_array([main, off, off], offsets=[0, 1, -1])
    assert smallest_eigenvalue(free) == pytest.approx(0.0, abs=1e-13)
    main[n // 2] -= 0.5
    found = smallest_eigenvalue(sp.diags_array([main, off, off], offsets=[0, 1, -1]))
    # an infinite chain with the defect -g: lambda = 2 - sqrt(4 + g²)
    assert found == pytest.approx(2.0 - np.sqrt(4.25), rel=1e-10)


def test_ends_of_the_range():
    assert smallest_eigenvalue(np.zeros((0, 0))) == 0.0
    assert smallest_eigenvalue(sp.csc_array((900, 900))) == pytest.approx(0.0, abs=1e-12)
    assert smallest_eigenvalue(-sp.eye_array(900)) == pytest.approx(-1.0, rel=1e-12)
    with pytest.raises(ValueError, match="not finite"):
        smallest_eigenvalue(np.array([[np.nan]]))
