"""Wei (1990): mass and stiffness changed least at once (2.84, 2.85)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def wei(
    K: Real, M: Real, Phi: Real, eigenvalues: Real, stiffness_weight: float = 1.0
) -> DirectUpdate:
    """Symmetric M, K of least ‖M_A^-½ ΔM M_A^-½‖² + w ‖M_A^-½ ΔK M_A^-½‖² with Φᵀ M Φ = I and K Φ =
    M Φ Λ.

    Parameters
    ----------
    K, M : (N, N), M positive definite; Phi : (N, m); eigenvalues : (m,) λ = ω²; stiffness_weight :
    w in (s/rad)⁴ (1 as printed; 1/λ̄² makes
    both terms alike).

    In mass-normalised coordinates X = M_A^½ Φ = Q₁ R the constraints fix M₁₁ = R⁻ᵀ R⁻¹, K₁₁ = M₁₁ S
    and K₂₁ = M₂₁ S with S = R Λ R⁻¹; what is left is a least-squares problem for M₂₁ alone: M₂₁ (I
    + w S Sᵀ) = w K_A,₂₁ Sᵀ. This is (2.85), whose print is damaged.
    """
    check(len(M), Phi, eigenvalues)
    if not stiffness_weight > 0.0:
        raise InputError(f"wei: stiffness_weight {stiffness_weight} must be above 0.")
    try:
        L = la.cholesky(M, lower=True)
    except la.LinAlgError as error:
        raise InputError(
            "wei: the initial mass matrix is not positive definite. Condense out the "
            "massless DOFs first."
        ) from error
    # Any square root serves: L^-1 Δ L^-T has the Frobenius norm of M^-½ Δ M^-½.
    m = Phi.shape[1]
    Q, R = la.qr(L.T @ Phi)
    R = R[:m]
    K_hat = (
        Q.T
        @ symmetric(la.solve_triangular(L, la.solve_triangular(L, K, lower=True).T, lower=True))
        @ Q
    )
    Ri = la.solve_triangular(R, np.eye(m))
    S = R @ np.diag(eigenvalues) @ Ri
    M_new, K_new = np.eye(len(M)), K_hat.copy()
    M_new[:m, :m] = symmetric(Ri.T @ Ri)
    M21 = la.solve(
        (np.eye(m) + stiffness_weight * S @ S.T).T, (stiffness_weight * K_hat[m:, :m] @ S.T).T
    ).T
    M_new[m:, :m], M_new[:m, m:] = M21, M21.T
    K_new[:m, :m] = symmetric(Ri.T @ np.diag(eigenvalues) @ Ri)
    K_new[m:, :m] = M21 @ S
    K_new[:m, m:] = K_new[m:, :m].T
    back = L @ Q
    return DirectUpdate("Wei", symmetric(back @ M_new @ back.T), symmetric(back @ K_new @ back.T))
