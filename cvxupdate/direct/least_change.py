"""The two least symmetric changes that every Lagrange-multiplier method is made of (2.7.1)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def least_change_congruent(W: Real, B: Real, C: Real) -> Real:
    """The symmetric Δ (N, N) of least ‖W^-½ Δ W^-½‖_F with Bᵀ Δ B = C: Δ = W B S⁻¹ C S⁻¹ Bᵀ W, S =
    Bᵀ W B.

    Parameters
    ----------
    W : (N, N) positive definite weight; B : (N, k) of full rank; C : (k, k) symmetric.
    """
    WB = W @ B
    P = _right(WB, B)
    return symmetric(P @ C @ P.T)


def least_change_acting(W: Real, X: Real, Y: Real, terms: float = 0.0) -> Real:
    """The symmetric Δ (N, N) of least ‖W^-½ Δ W^-½‖_F with Δ X = Y: Δ = Y Pᵀ + P Yᵀ − P Xᵀ Y Pᵀ, P
    = W X (Xᵀ W X)⁻¹.

    Parameters
    ----------
    W : (N, N) positive definite weight; X : (N, k) of full rank; Y : (N, k).
    terms : the size of what Y is a difference of, ‖K X‖, against which rounding is distinguished
    from asymmetry.

    Raises
    ------
    InputError
        When Xᵀ Y is not symmetric: no symmetric Δ acts so (the shapes are not orthogonal in the
        mass matrix).
    """
    T = X.T @ Y
    size = max(
        float(np.abs(T).max(initial=0.0)),
        float(np.linalg.norm(X)) * max(float(np.linalg.norm(Y)) * 1e-3, terms * 1e-6),
        np.finfo(float).tiny,
    )
    if float(np.abs(T - T.T).max(initial=0.0)) > 1e-6 * size:
        raise InputError(
            "no symmetric matrix satisfies the equations: the shapes are not orthogonal in the "
            "mass matrix. Correct them first (baruch_shapes), or update the mass first "
            "(berman_mass)."
        )
    P = _right(W @ X, X)
    return symmetric(Y @ P.T + P @ Y.T - P @ symmetric(T) @ P.T)


def symmetric(A: Real) -> Real:
    """(A + Aᵀ) / 2: rounding leaves a symmetric formula a little unsymmetric."""
    return np.asarray(0.5 * (A + A.T))


def _right(WB: Real, B: Real) -> Real:
    """W B (Bᵀ W B)⁻¹."""
    S = symmetric(B.T @ WB)
    try:
        return np.asarray(la.solve(S, WB.T, assume_a="pos").T)
    except la.LinAlgError as error:
        raise InputError(
            "the shapes are linearly dependent, or the weight is not positive definite. "
            "Leave a shape out."
        ) from error


def check(N: int, Phi: Real, eigenvalues: Real | None = None) -> None:
    """Raise InputError unless shapes (N, m) and eigenvalues (m,) fit a model of ``N`` DOFs and are
    finite."""
    if Phi.ndim != 2 or Phi.shape[0] != N or not 1 <= Phi.shape[1] <= N:
        raise InputError(
            f"shapes must be ({N}, modes) with 1 to {N} modes, got {Phi.shape}; expand them "
            "to every DOF first."
        )
    if not np.all(np.isfinite(Phi)):
        raise InputError("shapes have entries that are not finite; expand them to every DOF first.")
    if eigenvalues is not None and (
        eigenvalues.shape != (Phi.shape[1],) or not np.all(np.isfinite(eigenvalues))
    ):
        raise InputError(
            f"{Phi.shape[1]} shapes need as many finite eigenvalues, got shape {eigenvalues.shape}."
        )
