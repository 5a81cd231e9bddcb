"""Symmetric eigenproblems of many matrices in one call."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from cvxupdate.fe.elements.base import Real


def eigh(A: Real) -> tuple[Real, Real]:
    """Eigenvalues (n, q) and eigenvectors (n, q, q) of symmetric matrices ``A`` (n, q, q), of which
    the lower triangles count. Divide and conquer (LAPACK's syevd), which on a matrix of low rank
    may fail to converge; then each by QR iterations (syev), which take longer and do not.

    Raises
    ------
    LinAlgError
        Where these fail, too: a matrix is not finite.
    """
    try:
        values, vectors = np.linalg.eigh(A)
    except np.linalg.LinAlgError:
        flat = A.reshape(-1, *A.shape[-2:])
        found = [la.eigh(a, driver="ev", check_finite=False) for a in flat]
        values = np.array([v for v, _ in found]).reshape(A.shape[:-1])
        vectors = np.array([V for _, V in found]).reshape(A.shape)
    return np.asarray(values), np.asarray(vectors)
