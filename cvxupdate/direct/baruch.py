"""Baruch and Bar Itzhack (1978): shapes corrected to orthogonality, then the stiffness changed
least (2.73 to 2.77)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, least_change_acting, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def baruch_shapes(M: Real, Phi: Real) -> Real:
    """The shapes nearest to ``Phi`` in the mass norm with Φᵀ M Φ = I: Φ (Φᵀ M Φ)^-½ (2.75), (N, m).

    ``Phi`` (N, m) is taken at the scale it has; scale it to unit modal mass first where its scale
    means nothing.
    """
    check(len(M), Phi)
    values, vectors = np.linalg.eigh(symmetric(Phi.T @ M @ Phi))
    if values[0] <= 1e-12 * values[-1]:
        raise InputError("the shapes are linearly dependent in the mass matrix. Leave one out.")
    return np.asarray(Phi @ (vectors / np.sqrt(values)) @ vectors.T)


def baruch(K: Real, M: Real, Phi: Real, eigenvalues: Real, correct: bool = True) -> DirectUpdate:
    """The symmetric K of least ‖M^-½ (K_U − K_A) M^-½‖ with K_U Φ = M Φ Λ; the mass is right (2.76,
    2.77; Baruch 1978).

    Parameters
    ----------
    K, M : (N, N); Phi : (N, m); eigenvalues : (m,) λ = ω² in (rad/s)². correct : make the shapes
    orthogonal first.

    Raises
    ------
    InputError
        Shapes that do not fit, or are not orthogonal while ``correct`` is False.
    """
    check(len(M), Phi, eigenvalues)
    X = baruch_shapes(M, Phi) if correct else Phi
    change = least_change_acting(
        M, X, M @ X * eigenvalues[None, :] - K @ X, float(np.linalg.norm(K @ X))
    )
    return DirectUpdate("Baruch", M.copy(), K + change)
