"""The smallest eigenvalue of a sparse symmetric matrix, proved to be the smallest by the signs of
pivots."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

DENSE = 500  # rows up to which LAPACK computes all eigenvalues
SHIFT = 1e-9  # first shift, relative to the largest absolute row sum
ACCURACY = 1e-10  # of λ − σ
STEPS = 300


def smallest_eigenvalue(matrix: Any) -> float:
    """λ_min of a symmetric (N, N) sparse or dense matrix; 0 for an empty one.

    Above ``DENSE`` rows a shift σ = −τ is lowered until A + τ I has no negative pivot, so that no
    eigenvalue lies below σ (Sylvester's law of inertia); the eigenvalue nearest to σ, found by
    shift-invert Lanczos with those same factors, is then the smallest one: to rounding where it
    stands apart, within `ACCURACY` of λ − σ in a cluster.

    Raises
    ------
    ValueError
        When the matrix is not finite.
    """
    A = sp.csc_array(matrix)
    if not np.all(np.isfinite(A.data)):
        raise ValueError("smallest_eigenvalue: the matrix has entries that are not finite")
    N = A.shape[0]
    if N == 0:
        return 0.0
    if N <= DENSE:
        return float(np.linalg.eigvalsh(A.toarray())[0])
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

    size = float(abs(A).sum(axis=1).max()) or 1.0
    tau = SHIFT * size
    while True:
        try:
            factor = splu(
                sp.csc_array(A + tau * sp.eye_array(N)),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            below = not np.array_equal(factor.perm_r, factor.perm_c) or bool(
                np.any(factor.U.diagonal() <= 0.0)
            )
        except RuntimeError:  # exactly singular at this shift
            below = True
        if not below:
            break
        tau *= 10.0  # ends: for τ above the largest row sum the matrix is diagonally dominant
    inverse = LinearOperator((N, N), matvec=factor.solve, dtype=float)
    start = factor.solve(np.random.default_rng(0).standard_normal(N))
    for ncv in (20, 80, 320):
        try:
            x = eigsh(
                inverse, 1, which="LA", tol=ACCURACY, ncv=min(ncv, N - 1), v0=start, maxiter=2000
            )[1][:, 0]
        except ArpackError:
            continue
        return float(x @ (A @ x) / (x @ x))
    for _ in range(STEPS):  # a cluster that Lanczos does not part: inverse iteration ends in it
        start = factor.solve(start / np.linalg.norm(start))
    return float(start @ (A @ start) / (start @ start))
