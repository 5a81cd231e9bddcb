"""Error-matrix methods: where the model is wrong, to first or second order (2.89 to 2.92). They
locate; they reproduce no mode exactly."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def flexibility(Phi: Real, eigenvalues: Real) -> Real:
    """Φ Λ⁻¹ Φᵀ (N, N) in m/N; rigid-body modes (λ = 0) must be left out. Raises InputError for λ ≤
    0."""
    check(len(Phi), Phi, eigenvalues)
    if np.any(eigenvalues <= 0.0):
        raise InputError("flexibility: an eigenvalue is not above 0; leave rigid-body modes out.")
    return np.asarray((Phi / eigenvalues[None, :]) @ Phi.T)


def inverse(K: Real, method: str) -> Real:
    """K⁻¹ (N, N). Raises InputError, in the name of a method, where K is singular."""
    try:
        return np.asarray(la.inv(K))
    except la.LinAlgError as error:
        raise InputError(
            f"{method}: K is singular (a free structure); give flexibility_a of the flexible "
            "modes, as gysin does."
        ) from error


def sidhu_ewins(K: Real, flexibility_x: Real, flexibility_a: Real | None = None) -> Real:
    """ΔK ≈ K_A (K_A⁻¹ − K_X⁻¹) K_A (2.90; Sidhu and Ewins 1984), (N, N); the error is of second
    order in ΔK."""
    if flexibility_a is None:
        flexibility_a = inverse(K, "sidhu_ewins")
    return symmetric(K @ (flexibility_a - flexibility_x) @ K)


def second_order(K: Real, flexibility_x: Real, flexibility_a: Real | None = None) -> Real:
    """ΔK ≈ ΔK₁ + ΔK₁ K_A⁻¹ ΔK₁ with ΔK₁ of `sidhu_ewins` (Zhang and Lallement 1987), (N, N); the
    error is of third order. Of the same few modes of both, ``flexibility_a`` those of the model."""
    first = sidhu_ewins(K, flexibility_x, flexibility_a)
    own = la.inv(K) if flexibility_a is None else flexibility_a
    return symmetric(first + first @ (own - flexibility_x) @ K)


def gysin(
    K: Real, M: Real, Phi_a: Real, eigenvalues_a: Real, Phi_x: Real, eigenvalues_x: Real
) -> tuple[Real, Real]:
    """(ΔK, ΔM) from the same few modes of both, unit modal mass (2.91; Gysin 1986), (N, N) each."""
    check(len(M), Phi_a, eigenvalues_a)
    check(len(M), Phi_x, eigenvalues_x)
    dK = sidhu_ewins(K, flexibility(Phi_x, eigenvalues_x), flexibility(Phi_a, eigenvalues_a))
    return dK, symmetric(M @ (Phi_a @ Phi_a.T - Phi_x @ Phi_x.T) @ M)


def lieven_ewins(
    Phi_a: Real, eigenvalues_a: Real, Phi_x: Real, eigenvalues_x: Real, rank: int | None = None
) -> tuple[Real, Real]:
    """(ΔK, ΔM) by pseudo-inverses of the modal flexibilities, no system matrices needed (2.92;
    Lieven and Ewins 1990), (N, N) each.

    K = (Φ Λ⁻¹ Φᵀ)⁺: the printed (2.92) has Λ for Λ⁻¹, which is no stiffness. ``rank`` singular
    values are kept (None: all above 1e-12). Exact when all modes of both are given.
    """
    stiff = [
        _pinv(flexibility(P, v), rank) for P, v in ((Phi_x, eigenvalues_x), (Phi_a, eigenvalues_a))
    ]
    mass = [_pinv(P @ P.T, rank) for P in (Phi_x, Phi_a)]
    return symmetric(stiff[0] - stiff[1]), symmetric(mass[0] - mass[1])


def _pinv(A: Real, rank: int | None) -> Real:
    U, s, Vt = la.svd(symmetric(A))
    keep = s > 1e-12 * s[0]
    if rank is not None:
        keep &= np.arange(len(s)) < rank
    return np.asarray((Vt[keep].T / s[keep]) @ U[:, keep].T)
