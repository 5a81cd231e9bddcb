"""The classical solutions of A p = b that are not convex programs (thesis chapter 4): least squares
and its truncation by SVD, total least squares, Landweber–Fridman, conjugate gradients. Pure
functions of arrays, without bounds: `convex` has those."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import InputError
from cvxupdate.system import Array


@dataclass(frozen=True)
class Picard:
    """``singular`` values σ_i, ``coefficients`` |u_iᵀ b|, and the ``level`` n_t: how many terms
    rise above the noise floor, which is twice the deviation ``noise`` of an entry of b."""

    singular: Array
    coefficients: Array
    level: int
    noise: float = 0.0


def svd_least_squares(A: Array, b: Array, level: int | None = None, rcond: float = 1e-12) -> Array:
    """p = Σ σ_i⁻¹ (u_iᵀ b) v_i over the first ``level`` terms (2.124; 4.11; 4.10 as the errata
    has it); None: all above ``rcond`` σ_1.

    Raises
    ------
    InputError
        When ``level`` is below 1.
    """
    if level is not None and level < 1:
        raise InputError(f"truncated SVD: level {level} keeps nothing; give 1 or more.")
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    rank = int(np.sum(s > rcond * s[0])) if s.size and s[0] > 0 else 0
    keep = rank if level is None else min(level, rank)
    return np.asarray(Vt[:keep].T @ ((U[:, :keep].T @ b) / s[:keep]))


def picard(A: Array, b: Array, noise: float | None = None) -> Picard:
    """Picard's condition (Hansen 1990): the level is the last i up to which the coefficients,
    averaged geometrically over three, exceed the noise floor.

    ``noise``: standard deviation of an entry of b; None: estimated from the part of b that A cannot
    reach (Bᵀ u beyond the columns), the floor is twice that.
    """
    U, s, _ = np.linalg.svd(A, full_matrices=False)
    coefficients = np.abs(U.T @ b)
    rest = b - U @ (U.T @ b)
    freedom = A.shape[0] - len(s)
    deviation = (
        noise
        if noise is not None
        else float(np.linalg.norm(rest)) / np.sqrt(freedom)
        if freedom > 0
        else 0.0
    )
    logs = np.log(np.maximum(coefficients, np.finfo(float).tiny))
    smooth = np.exp(np.array([np.mean(logs[max(0, i - 1) : i + 2]) for i in range(len(s))]))
    above = smooth > 2.0 * deviation
    level = int(np.flatnonzero(above)[-1]) + 1 if np.any(above) else 1
    return Picard(s, coefficients, level, deviation)


def tikhonov(A: Array, b: Array, alpha: float, reference: Array | float = 0.0) -> Array:
    """(Aᵀ A + α I)⁻¹ (Aᵀ b + α x*) by the stacked system, whose block is √α I (4.7; errata)."""
    n = A.shape[1]
    start = np.broadcast_to(np.asarray(reference, dtype=float), (n,))
    stacked = np.vstack([A, np.sqrt(alpha) * np.eye(n)])
    return np.asarray(
        np.linalg.lstsq(stacked, np.concatenate([b, np.sqrt(alpha) * start]), rcond=None)[0]
    )


@dataclass(frozen=True)
class Total:
    """Total least squares: the solution ``p``, the ``rank`` taken for [A b], the singular values
    (4.16) and |α| of (4.18)."""

    p: Array
    rank: int
    singular: Array
    alpha: float


def total_least_squares(
    A: Array,
    b: Array,
    D: Array | None = None,
    T: Array | None = None,
    noise: float | None = None,
    epsilon: float = 1e-8,
    rank: int | None = None,
) -> Total:
    """min ‖D [E r] T‖_F with b + r in the range of A + E (4.14–4.18; Golub & Van Loan 1980, Van
    Huffel & Vandewalle 1985).

    ``D`` (m,) row weights, ``T`` (n + 1,) column weights; ``noise`` the standard deviation of an
    entry of D [A b] T, for the rank test σ_r² ≥ 2 max(m, n) σ_ν² (4.17), None: the ``rank`` given
    (None: full, n). Where
    |α| < ``epsilon`` the rank is lowered by the multiplicity of σ_r (step 4). Minimum norm when the
    rank is below n.

    Raises
    ------
    InputError
        When a weight is not above 0, or no rank is left that has a solution.
    """
    m, n = A.shape
    d = np.ones(m) if D is None else np.asarray(D, dtype=float)
    t = np.ones(n + 1) if T is None else np.asarray(T, dtype=float)
    if d.shape != (m,) or t.shape != (n + 1,) or not np.all(d > 0) or not np.all(t > 0):
        raise InputError(f"total least squares: D needs {m} weights and T {n + 1}, all above 0.")
    _, s, Vt = np.linalg.svd(d[:, None] * np.column_stack([A, b]) * t, full_matrices=True)
    s = np.concatenate([s, np.zeros(n + 1 - len(s))])
    if noise is not None:
        rank = int(np.sum(s**2 >= 2.0 * max(m, n) * noise**2))
    rank = n if rank is None else min(n, rank)
    while rank > 0:
        V2 = Vt[rank:].T
        # The Householder matrix of (4.18) turns the last row of V2 to (0, …, 0, α); its last column
        # is V2 V2[-1]ᵀ / α.
        alpha = float(np.linalg.norm(V2[-1]))
        if alpha >= epsilon:
            y = V2[:n] @ V2[-1] / alpha
            return Total(-(t[:n] * y) / (alpha * t[n]), rank, s, alpha)
        same = s[:rank] <= s[rank - 1] * (1.0 + 1e-10)
        rank -= int(np.sum(same))
    raise InputError(
        "total least squares: no rank has a solution with |α| above epsilon: b is orthogonal "
        "to A's range. Lower epsilon, or use least squares."
    )


@dataclass(frozen=True)
class Iterated:
    """``p``, the number of ``iterations`` and the norms ‖A p − b‖ after each."""

    p: Array
    iterations: int
    residual: Array


def landweber(
    A: Array,
    b: Array,
    iterations: int = 1000,
    discrepancy: float | None = None,
    relaxation: float = 1.0,
) -> Iterated:
    """Landweber–Fridman (2.121): p ← p + τ Aᵀ(b − A p), τ = relaxation/σ₁² (0 < relaxation < 2);
    the number of iterations regularises.

    Stops where ‖A p − b‖ ≤ ``discrepancy``.

    Raises
    ------
    InputError
        When the relaxation is outside (0, 2).
    """
    if not 0.0 < relaxation < 2.0:
        raise InputError(f"Landweber: relaxation {relaxation:g} must lie between 0 and 2.")
    tau = relaxation / max(float(np.linalg.norm(A, 2)) ** 2, np.finfo(float).tiny)
    p = np.zeros(A.shape[1])
    norms: list[float] = []
    r = b.astype(float)
    for _ in range(iterations):
        if discrepancy is not None and np.linalg.norm(r) <= discrepancy:
            break
        p = p + tau * (A.T @ r)
        r = b - A @ p
        norms.append(float(np.linalg.norm(r)))
    return Iterated(p, len(norms), np.array(norms))


def conjugate_gradients(
    A: Array,
    b: Array,
    iterations: int | None = None,
    discrepancy: float | None = None,
    tolerance: float = 1e-12,
) -> Iterated:
    """CGLS (2.122, 2.123) on the normal equations without forming them (Hestenes & Stiefel 1952): p
    from the Krylov space of Aᵀ b; stopping early regularises.

    Stops after ``iterations`` (None: 10 n, since rounding spoils the finite termination), where ‖A
    p − b‖ ≤ ``discrepancy``, or where ‖Aᵀ r‖ has fallen by ``tolerance``.
    """
    n = A.shape[1]
    p, r = np.zeros(n), b.astype(float)
    g = A.T @ r
    q, gamma = g, float(g @ g)
    first = gamma
    norms: list[float] = []
    for _ in range(10 * n if iterations is None else iterations):
        if (
            gamma <= tolerance**2 * first
            or gamma == 0.0
            or (discrepancy is not None and np.linalg.norm(r) <= discrepancy)
        ):
            break
        w = A @ q
        step = gamma / float(w @ w)
        p, r = p + step * q, r - step * w
        g = A.T @ r
        new = float(g @ g)
        q, gamma = g + (new / gamma) * q, new
        norms.append(float(np.linalg.norm(r)))
    return Iterated(p, len(norms), np.array(norms))
