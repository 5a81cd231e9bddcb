"""Error matrices with damping (He and Ewins 1986) and weighted by what the measurement may be off
(Park and Lee 1988), of section 2.7.3."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.error_matrix import flexibility, inverse
from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def he_ewins(
    K: Real, Phi: NDArray[Any], eigenvalues: NDArray[Any], flexibility_a: Real | None = None
) -> tuple[Real, Real]:
    """(ΔK, D) from complex modes, ΔK + i D ≈ K (F_A − Φ Λ⁻¹ Φᵀ) K: the error matrix (2.90) of a
    hysteretically damped structure (He and Ewins 1986), (N, N) each. What is left is of second
    order in ΔK + i D.

    Parameters
    ----------
    K : (N, N) of the undamped model; Phi : (N, m) complex, Φᵀ M Φ = I; eigenvalues : (m,) λ = ω² (1
    + i η); flexibility_a : F_A (N, N) of the model's own same modes, None where all were measured
    (K⁻¹).

    Raises
    ------
    InputError
        A singular K (a free structure) without ``flexibility_a``, or an eigenvalue not above zero.
    """
    check(len(K), Phi.real)
    if eigenvalues.shape != (Phi.shape[1],) or np.any(np.real(eigenvalues) <= 0.0):
        raise InputError(
            "he_ewins: give one eigenvalue ω² (1 + i η) above 0 for each shape; leave rigid-body "
            "modes out."
        )
    if flexibility_a is None:
        flexibility_a = inverse(K, "he_ewins")
    change = K @ (flexibility_a - (Phi / eigenvalues[None, :]) @ Phi.T) @ K
    return symmetric(np.real(change)), symmetric(np.imag(change))


def error_deviation(
    K: Real, Phi: Real, eigenvalues: Real, shape_std: Real, eigenvalue_std: Real
) -> Real:
    """Standard deviation (N, N) of every entry of the error matrix (2.91) that deviations of the
    modes bring, to first order, N/m.

    Parameters
    ----------
    Phi, shape_std : (N, m) entries of the measured shapes, independent; eigenvalues, eigenvalue_std
    : (m,) in (rad/s)².
    """
    check(len(K), Phi, eigenvalues)
    variance = np.zeros_like(K)
    for phi, lam, s, sl in zip(Phi.T, eigenvalues, shape_std.T, eigenvalue_std, strict=True):
        v = K @ phi
        cov = (K * s[None, :] ** 2) @ K  # of K δφ
        d = np.diag(cov)
        variance += (
            d[:, None] * v[None, :] ** 2 + v[:, None] ** 2 * d[None, :] + 2.0 * cov * np.outer(v, v)
        ) / lam**2 + np.outer(v, v) ** 2 * (sl / lam**2) ** 2
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def park_lee(
    K: Real,
    own: Real,
    own_eigenvalues: Real,
    Phi: Real,
    eigenvalues: Real,
    shape_std: Real,
    eigenvalue_std: Real,
) -> tuple[Real, Real]:
    """(ΔK, Z): the error matrix (2.91) weighted entry by entry, and the entries in deviations.

    Park and Lee (1988) weight the error matrix so that a change of stiffness is found that is
    smaller than what errors of measurement make elsewhere. Here Z is each entry over its own
    deviation (`error_deviation`), and ΔK keeps Z² / (1 + Z²) of the entries on the pattern of K and
    nothing off it, where no element could have changed: the best linear estimate of an entry whose
    own size is that deviation's multiple, and the connectivity stays.

    Parameters
    ----------
    K : (N, N); own, Phi : (N, m) the model's and the measured modes, unit modal mass;
    own_eigenvalues, eigenvalues : (m,); shape_std (N, m), eigenvalue_std (m,) of the measured ones.
    """
    change = symmetric(K @ (flexibility(own, own_eigenvalues) - flexibility(Phi, eigenvalues)) @ K)
    deviation = error_deviation(K, Phi, eigenvalues, shape_std, eigenvalue_std)
    inside = K != 0.0
    known = deviation > 0.0
    z = np.where(known, change / np.where(known, deviation, 1.0), np.inf * np.sign(change))
    z = np.where(inside & (change != 0.0), z, 0.0)
    # 1 / (1 + 1/z²): one where nothing is uncertain, zero where the entry is
    weight = np.where(z != 0.0, 1.0 / (1.0 + 1.0 / np.where(z != 0.0, z, 1.0) ** 2), 0.0)
    return symmetric(change * weight), z
