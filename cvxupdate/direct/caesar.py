"""Caesar (1986): the same problems under other norms, with the rigid-body mass (mass, centre of
gravity, inertia) kept."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.least_change import (
    check,
    least_change_acting,
    least_change_congruent,
    symmetric,
)
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]
NORMS = ("mass", "stiffness", "identity")


def caesar(
    K: Real,
    M: Real,
    Phi: Real,
    eigenvalues: Real,
    rigid: Real | None = None,
    rigid_mass: Real | None = None,
    norm: str = "mass",
    orthogonal: bool = True,
) -> DirectUpdate:
    """Mass changed least with Φᵀ M Φ = I and Rᵀ M R = J, then stiffness changed least with K Φ = M
    Φ Λ and K R kept.

    Parameters
    ----------
    K, M : (N, N); Phi : (N, m); eigenvalues : (m,) λ = ω².
    rigid : R (N, r) rigid-body motions; rigid_mass : J (r, r), None keeps that of M (total mass,
    centre of gravity and inertia conserved).
    norm : weight of the change: "mass" (‖M^-½ Δ M^-½‖), "stiffness" (K + M over their traces, so
    that rigid bodies count), "identity".
    orthogonal : also ask Φᵀ M R = 0 (free structures: flexible modes carry no momentum).
    """
    check(len(M), Phi, eigenvalues)
    W = weight(K, M, norm)
    mass = caesar_mass(M, Phi, rigid, rigid_mass, W, orthogonal)
    X, Y = Phi, mass @ Phi * eigenvalues[None, :] - K @ Phi
    if rigid is not None and orthogonal:
        X, Y = (
            np.column_stack([Phi, rigid]),
            np.column_stack([Y, np.zeros_like(rigid)]),
        )  # K R stays what it is: 0 for a free structure
    return DirectUpdate(
        f"Caesar ({norm} norm)",
        mass,
        K + least_change_acting(W, X, Y, float(np.linalg.norm(K @ Phi))),
    )


def caesar_mass(
    M: Real, Phi: Real, rigid: Real | None, rigid_mass: Real | None, W: Real, orthogonal: bool
) -> Real:
    """The mass matrix of `caesar`."""
    m = Phi.shape[1]
    if rigid is None:
        return M + least_change_congruent(W, Phi, np.eye(m) - Phi.T @ M @ Phi)
    J = rigid.T @ M @ rigid if rigid_mass is None else rigid_mass
    if J.shape != (rigid.shape[1], rigid.shape[1]):
        raise InputError(
            f"caesar: rigid_mass is {J.shape}, but there are {rigid.shape[1]} rigid-body motions."
        )
    B = np.column_stack([Phi, rigid])
    now = B.T @ M @ B
    wanted = now.copy()
    wanted[:m, :m], wanted[m:, m:] = np.eye(m), J
    if orthogonal:
        wanted[:m, m:] = wanted[m:, :m] = 0.0
        return M + least_change_congruent(W, B, wanted - now)
    # The cross block is free: the change is W B Y Bᵀ W with Y zero in the cross block; its two
    # diagonal blocks solve a linear problem.
    S = symmetric(B.T @ W @ B)
    return M + W @ B @ _block_diagonal(S, wanted - now, m) @ B.T @ W


def _block_diagonal(S: Real, C: Real, m: int) -> Real:
    """Y = diag(Y1, Y2), symmetric, with (S Y S) = C in both diagonal blocks (stationarity of the
    least change with two constraints)."""
    k = len(S)
    unknowns = [(i, j) for i in range(k) for j in range(i, k) if (i < m) == (j < m)]
    columns = []
    for i, j in unknowns:
        E = np.zeros((k, k))
        E[i, j] = E[j, i] = 1.0
        T = S @ E @ S
        columns.append([T[a, b] for a, b in unknowns])
    y = la.solve(np.array(columns).T, np.array([C[a, b] for a, b in unknowns]))
    Y = np.zeros((k, k))
    for (i, j), value in zip(unknowns, y, strict=True):
        Y[i, j] = Y[j, i] = value
    return Y


def weight(K: Real, M: Real, norm: str) -> Real:
    """The weight W of the norm ‖W^-½ Δ W^-½‖."""
    if norm == "mass":
        return M
    if norm == "stiffness":
        return np.asarray(K / np.trace(K) + M / np.trace(M))
    if norm == "identity":
        return np.eye(len(M))
    raise InputError(f"caesar: unknown norm {norm!r}; choose one of {', '.join(NORMS)}.")
