"""Eigenstructure assignment by feedback: Minas and Inman (2.93 to 2.97), and the symmetric one of
Zimmerman and Widengren."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.fuh_chen import realised
from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def minas_inman(
    K: Real,
    M: Real,
    C: Real,
    Phi: NDArray[Any],
    rates: NDArray[Any],
    B0: Real | None = None,
    D0: Real | None = None,
    D1: Real | None = None,
) -> DirectUpdate:
    """K_U = K − B₀ G D₀, C_U = C − B₀ G D₁ with the gain G that gives the structure the modes
    (2.93 to 2.97); not symmetric as a rule.

    Parameters
    ----------
    K, M, C : (N, N); Phi : (N, m) complex; rates : (m,) complex s, one of each conjugate pair.
    B0 : (N, b) where the "actuators" push; None: the span of the force residual, so that the
    assignment is exact.
    D0, D1 : (q, N) outputs of displacement and velocity with D₁ΦΛ + D₀Φ of full column rank; None:
    the modes' own span.

    Raises
    ------
    InputError
        When the outputs cannot distinguish the modes, or the shapes do not fit.
    """
    check(len(M), Phi.real)
    X, block = realised(Phi, rates)
    XL = X @ block
    force = M @ XL @ block + C @ XL + K @ X
    if B0 is None:
        U, s, _ = la.svd(force, full_matrices=False)
        B0 = U[:, s > 1e-14 * s[0]] if s[0] > 0 else U[:, :1]
    if D0 is None or D1 is None:
        size = float(np.mean(np.abs(rates)))
        basis = la.qr(np.vstack([X, XL / size]), mode="economic")[0]
        D0, D1 = basis[: len(M)].T, basis[len(M) :].T / size
    outputs = D1 @ XL + D0 @ X
    if np.linalg.matrix_rank(outputs, tol=1e-12 * np.linalg.norm(outputs, 2)) < outputs.shape[1]:
        raise InputError(
            "minas_inman: the outputs D0, D1 cannot distinguish the modes. Choose more "
            "outputs, or leave them to the method."
        )
    G = la.pinv(B0) @ force @ la.pinv(outputs)
    return DirectUpdate("Minas and Inman", M.copy(), K - B0 @ G @ D0, C - B0 @ G @ D1)


def symmetric_gain(
    K: Real, M: Real, C: Real, Phi: NDArray[Any], rates: NDArray[Any]
) -> tuple[Real, Real, Real, Real]:
    """(Y, H_c, H_k, P): ΔC = Y H_c Yᵀ, ΔK = Y H_k Yᵀ in the span of the force residual Y (N, 2m),
    and P = H_k⁻¹ H_c.

    Assignment asks H_c a + H_k b = I with a = Yᵀ Φ Λ, b = Yᵀ Φ. Zimmerman and Widengren (1990)
    eliminate H_k and meet the algebraic Riccati equation P (a − aᵀ) Pᵀ + b Pᵀ − P bᵀ = 0; with both
    symmetric matrices kept as unknowns the same solutions solve a linear system, whose least one is
    taken. P is given back so that the Riccati equation can be checked.
    """
    X, block = realised(Phi, rates)
    rate = float(np.mean(np.abs(rates)))
    Y = -(M @ X @ block @ block + C @ X @ block + K @ X)
    s = la.svdvals(Y)
    if s[-1] <= 1e-10 * s[0]:
        raise InputError(
            "symmetric assignment: the force residuals of the modes are linearly dependent "
            "(a mode that the model already has, or one too many). Leave it out."
        )
    a, b = Y.T @ X @ block / rate, Y.T @ X
    k = len(b)
    pairs = [(i, j) for i in range(k) for j in range(i, k)]
    columns = []
    for g in (a, b):
        for i, j in pairs:
            E = np.zeros((k, k))
            E[i, j] = E[j, i] = 1.0 / max(float(np.linalg.norm(g)), np.finfo(float).tiny)
            columns.append((E @ g).reshape(-1))
    system, right = np.array(columns).T, np.eye(k).reshape(-1)
    scale = np.linalg.norm(system, axis=0)
    x = la.lstsq(system / scale, right, cond=1e-15)[0] / scale
    H = []
    for part, g in zip((x[: len(pairs)], x[len(pairs) :]), (a, b), strict=True):
        T = np.zeros((k, k))
        for (i, j), value in zip(pairs, part, strict=True):
            T[i, j] = T[j, i] = value / max(float(np.linalg.norm(g)), np.finfo(float).tiny)
        H.append(T)
    if float(np.linalg.norm(H[0] @ a + H[1] @ b - np.eye(k))) > 1e-6 * np.sqrt(k):
        raise InputError(
            "symmetric assignment: no symmetric change in the span of the force residuals "
            "gives these modes."
        )
    Hc, Hk = H[0] / rate, H[1]
    return Y, Hc, Hk, la.solve(Hk, Hc)


def zimmerman_widengren(
    K: Real, M: Real, C: Real, Phi: NDArray[Any], rates: NDArray[Any]
) -> DirectUpdate:
    """Symmetric changes of C and K, in the span of the force residuals, that give the structure the
    modes (Zimmerman and Widengren 1990); see `symmetric_gain`.

    Real shapes uncouple the two: C Φ = −2 M Φ Re s, K Φ = M Φ |s|², and each change is the only
    symmetric one of rank m, Y (Yᵀ Φ)⁻¹ Yᵀ.
    """
    check(len(M), Phi.real)
    name = "Zimmerman and Widengren"
    if not np.any(np.imag(Phi)):
        X = np.asarray(Phi.real)
        MX = M @ X
        return DirectUpdate(
            name,
            M.copy(),
            K + _of_least_rank(X, MX * np.abs(rates)[None, :] ** 2, K @ X),
            C + _of_least_rank(X, -2.0 * MX * np.real(rates)[None, :], C @ X),
        )
    Y, Hc, Hk, _ = symmetric_gain(K, M, C, Phi, rates)
    return DirectUpdate(name, M.copy(), symmetric(K + Y @ Hk @ Y.T), symmetric(C + Y @ Hc @ Y.T))


def _of_least_rank(X: Real, wanted: Real, now: Real) -> Real:
    """Δ = Y (Yᵀ X)⁻¹ Yᵀ with Δ X = Y = ``wanted`` − ``now``; of modes that are right already
    nothing."""
    Y = wanted - now
    size = np.linalg.norm(wanted, axis=0) + np.linalg.norm(now, axis=0)
    moved = np.linalg.norm(Y, axis=0) > 1e-12 * size
    if not np.any(moved):
        return np.zeros((len(X), len(X)))
    Y = Y[:, moved]
    T = Y.T @ X[:, moved]
    bound = 1e-9 * np.outer(size[moved], np.linalg.norm(X[:, moved], axis=0))
    if np.any(np.abs(T - T.T) > np.maximum(bound, bound.T)):
        raise InputError(
            "symmetric assignment: no symmetric change gives these modes: the shapes are not "
            "orthogonal in the mass matrix. Correct them first (baruch_shapes)."
        )
    T = symmetric(T)
    if np.linalg.cond(T) > 1e13:
        raise InputError(
            "symmetric assignment: the force residuals of the modes cannot be told apart by the "
            "shapes. Leave a mode out."
        )
    return symmetric(Y @ la.solve(T, Y.T, assume_a="sym"))
