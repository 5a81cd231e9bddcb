"""Fuh and Chen (1984): the mass as reference, damping and stiffness changed least to hold complex
modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def realised(Phi: NDArray[Any], rates: NDArray[Any]) -> tuple[Real, Real]:
    """Real shapes (N, 2m) and the real block-diagonal Λ (2m, 2m) that span complex modes and their
    conjugates: Φ diag(s) ↔ Φ_r Λ_r."""
    m = Phi.shape[1]
    X = np.column_stack([Phi.real, Phi.imag])
    a, b = np.diag(rates.real), np.diag(rates.imag)
    return X, np.block([[a, b], [-b, a]]) if m else np.zeros((0, 0))


def fuh_chen(
    K: Real, M: Real, C: Real, Phi: NDArray[Any], rates: NDArray[Any], damping_weight: float = 1.0
) -> DirectUpdate:
    """Symmetric ΔC, ΔK of least w ‖M^-½ ΔC M^-½‖² + ‖M^-½ ΔK M^-½‖² with M Φ Λ² + (C + ΔC) Φ Λ + (K
    + ΔK) Φ = 0.

    Parameters
    ----------
    K, M, C : (N, N), M positive definite; Phi : (N, m) complex; rates : (m,) complex s (rad/s), one
    of each conjugate pair.
    damping_weight : w in (rad/s)²; None of the modes' own: the mean |s|² makes both terms alike.

    With the multiplier L (N, 2m): ΔC = (L G₁ᵀ + G₁ Lᵀ) / 2w, ΔK = (L G₂ᵀ + G₂ Lᵀ) / 2, G₁ = Φ Λ, G₂
    = Φ in mass-normalised coordinates. Outside the span of G₁, G₂ the equation is L S = 2 Y; inside
    it is a small linear system. Raises `InputError` for modes that no symmetric C, K has.
    """
    check(len(M), Phi.real)
    if (
        not damping_weight > 0.0
        or rates.shape != (Phi.shape[1],)
        or np.any(np.abs(rates.imag) == 0.0)
    ):
        raise InputError(
            "fuh_chen: needs one complex rate per shape (underdamped modes) and a "
            "damping_weight above 0."
        )
    Lm = la.cholesky(M, lower=True)
    X, block = realised(Phi, rates)
    G2 = Lm.T @ X
    G1 = G2 @ block
    force = -(M @ X @ block @ block + C @ X @ block + K @ X)
    Y = la.solve_triangular(Lm, force, lower=True)
    multiplier = _multiplier(G1, G2, Y, damping_weight)
    dC = symmetric(multiplier @ G1.T) / damping_weight
    dK = symmetric(multiplier @ G2.T)
    return DirectUpdate(
        "Fuh and Chen", M.copy(), symmetric(K + Lm @ dK @ Lm.T), symmetric(C + Lm @ dC @ Lm.T)
    )


def _multiplier(G1: Real, G2: Real, Y: Real, w: float) -> Real:
    """L with L (G₁ᵀG₁/w + G₂ᵀG₂) + G₁ Lᵀ G₁/w + G₂ Lᵀ G₂ = 2 Y."""
    scale1 = 1.0 / w
    S = G1.T @ G1 * scale1 + G2.T @ G2
    Q, sizes, _ = la.svd(np.column_stack([G1 * np.sqrt(scale1), G2]), full_matrices=False)
    Q = Q[:, sizes > 1e-12 * sizes[0]]
    g1, g2, y = Q.T @ G1, Q.T @ G2, Q.T @ Y
    r, k = y.shape
    outside = 2.0 * la.solve(S.T, (Y - Q @ y).T).T
    # vec by rows: (l S)_ij = Σ l_ik S_kj, (g lᵀ g)_ij = Σ g_ia l_ba g_bj.
    system = np.einsum("ib,aj->ijba", np.eye(r), S)
    for g, s in ((g1, scale1), (g2, 1.0)):
        system = system + s * np.einsum("ia,bj->ijba", g, g)
    matrix, right = system.reshape(r * k, r * k), 2.0 * y.reshape(-1)
    inside = la.lstsq(matrix, right, cond=1e-13)[0]
    if float(np.linalg.norm(matrix @ inside - right)) > 1e-7 * max(
        float(np.linalg.norm(right)), np.finfo(float).tiny
    ):
        raise InputError(
            "fuh_chen: no symmetric damping and stiffness with this mass have these modes; "
            "correct the shapes or the mass first."
        )
    return np.asarray(outside + Q @ inside.reshape(r, k))
