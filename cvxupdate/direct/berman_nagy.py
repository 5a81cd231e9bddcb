"""Berman (1979) and Berman and Nagy (1983): mass, then stiffness, changed least (2.78 to 2.83)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, least_change_acting, least_change_congruent
from cvxupdate.direct.result import DirectUpdate

Real = NDArray[np.float64]


def berman_mass(M: Real, Phi: Real) -> Real:
    """The symmetric M of least ‖M_A^-½ (M_U − M_A) M_A^-½‖ with Φᵀ M_U Φ = I (2.80), (N, N)."""
    check(len(M), Phi)
    return M + least_change_congruent(M, Phi, np.eye(Phi.shape[1]) - Phi.T @ M @ Phi)


def berman_nagy(K: Real, M: Real, Phi: Real, eigenvalues: Real) -> DirectUpdate:
    """Mass by `berman_mass`; then the symmetric K of least ‖M_A^-½ (K_U − K_A) M_A^-½‖ with K_U Φ =
    M_U Φ Λ (2.81 to 2.83).

    Parameters
    ----------
    K, M : (N, N); Phi : (N, m), at the scale of unit modal mass of the structure; eigenvalues :
    (m,) λ = ω².

    The weight of the second step is M_A, as (2.81) has it; the printed (2.83) holds with M_U for
    M_A in its products.
    """
    check(len(M), Phi, eigenvalues)
    mass = berman_mass(M, Phi)
    return DirectUpdate(
        "Berman and Nagy",
        mass,
        K
        + least_change_acting(
            M, Phi, mass @ Phi * eigenvalues[None, :] - K @ Phi, float(np.linalg.norm(K @ Phi))
        ),
    )
