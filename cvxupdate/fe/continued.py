"""Natural modes of a structure that has changed a little since its modes were known.

One factorisation of K, and Rayleigh–Ritz in a space that grows from the modes before by T = K⁻¹M
applied to what is left of the modes wanted (block Lanczos in its residuals: Golub and Underwood
1977; Stathopoulos and McCombs 2007). The factors stay: sensitivities of the shapes are solved with
them (`cvxupdate.residual.nelson`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factored, factored
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes

STEPS = 40  # blocks solved for, after which the modes are sought from nothing
EXACT = 1e-7
"""Estimated sine of the angle between a mode and what is found of it; what it really is was 10 to
100 times less on the models of problems/real/smu-modal-data."""
WIDE = 4  # times the modes carried: a space that has grown so far is reduced to its Ritz vectors
INDEPENDENT = 1e-13  # relative eigenvalue of a Gram matrix below which columns are rounding


@dataclass(frozen=True)
class Continued:
    """``modes`` of which the first ``exact`` have converged (the others are Ritz vectors), the
    ``factor`` of K, and M without stored zeros."""

    modes: Modes
    exact: int
    factor: Factored
    mass: sp.csc_array


def continued_modes(
    m: Matrices, before: Modes, wanted: int, accuracy: float = EXACT
) -> Continued | None:
    """As many modes as ``before`` has, the lowest ``wanted`` of them to ``accuracy`` (sine of an
    angle; eigenvalues to its square).

    None where they have to be sought from nothing: rigid-body modes, or no convergence. A mode that
    ``before`` does not contain may be missed; the Sturm count of `cvxupdate.fe.modes` tells.

    Raises
    ------
    ModelError
        When K is not positive definite although nothing was rigid before: a mechanism, or negative
        stiffness.
    """
    if before.rigid or not 0 < wanted <= len(before.eigenvalues):
        return None
    factor = factored(m.K, "the stiffness matrix", again=True)
    if factor.negatives() != 0:  # None: rows were exchanged, for a pivot was zero
        raise ModelError(
            "the stiffness matrix is not positive definite: a stiffness parameter has gone too "
            "far. Bound it from below."
        )
    M = m.M.copy()
    M.eliminate_zeros()  # K and M share a pattern, and M may be far emptier
    found = _grown(factor, M, before.shapes, wanted, accuracy)
    if found is None:
        return None
    values, shapes = found
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    return Continued(Modes(values, shapes * np.where(largest < 0, -1.0, 1.0), 0), wanted, factor, M)


def _grown(
    factor: Factored, M: sp.csc_array, X: Real, wanted: int, accuracy: float
) -> tuple[Real, Real] | None:
    """Eigenvalues and shapes, as many as X (N, b) has columns; None without convergence.

    What is left of a mode x = B y in the space B = K⁻¹MP is x − P y/λ, for T x would be x/λ: the
    error of P y. That of x is smaller by λ over the first eigenvalue that is not sought, because
    errors lie along the modes from there on.
    """
    b = X.shape[1]
    P = _orthonormal(X, M)
    B = np.zeros((len(X), 0))
    new = P
    for _ in range(STEPS):
        B = np.hstack([B, factor.solve(M @ new)])
        ritz = _ritz(P, B, M, b)
        if ritz is None:
            return None
        values, Y = ritz
        x = B @ Y
        left = x - P @ (Y / values)
        size = np.sqrt(np.einsum("ij,ij->j", left, M @ left))
        error = size * values / values[-1]
        open_ = np.flatnonzero(error[:wanted] > accuracy)
        if not len(open_):
            return values, x
        if P.shape[1] + len(open_) > WIDE * b:
            held = la.cholesky(Y.T @ (P.T @ (M @ P)) @ Y)
            turn = la.solve_triangular(held, Y.T, trans="T").T
            P, B = P @ turn, B @ turn
        new = left[:, open_] / size[open_]
        for _ in range(2):  # twice is enough
            new = new - P @ (P.T @ (M @ new))
        new = _orthonormal(new, M)
        if not new.shape[1]:
            return None
        P = np.hstack([P, new])
    return None


def _orthonormal(X: Real, M: sp.csc_array) -> Real:
    """Columns that span the same in the inner product of M, those that rounding tells apart."""
    X = X / np.sqrt(np.einsum("ij,ij->j", X, M @ X))
    weights, V = la.eigh(X.T @ (M @ X), check_finite=False)
    keep = weights > INDEPENDENT * weights[-1]
    return np.asarray(X @ (V[:, keep] / np.sqrt(weights[keep])))


def _ritz(P: Real, B: Real, M: sp.csc_array, count: int) -> tuple[Real, Real] | None:
    """The lowest ``count`` Ritz values in the span of B = K⁻¹MP, and the shapes' coefficients; None
    where rounding leaves fewer directions.

    BᵀKB = BᵀMP: nothing is multiplied by K, whose large entries would leave rounding in the small
    eigenvalues. For the same reason 1/λ is sought: the lowest modes have the largest.
    """
    MB = M @ B
    H = P.T @ MB
    scale = 1.0 / np.sqrt(H.diagonal())
    H = (H + H.T) / 2.0 * scale * scale[:, None]
    gram = B.T @ MB * scale * scale[:, None]
    if not (np.all(np.isfinite(gram)) and np.all(np.isfinite(H))):
        return None
    weights, V = la.eigh(H, check_finite=False)
    keep = weights > INDEPENDENT * weights[-1]
    if np.sum(keep) < count:
        return None
    T = V[:, keep] / np.sqrt(weights[keep])
    last = T.shape[1] - 1
    inverse, Y = la.eigh(
        T.T @ gram @ T, subset_by_index=[last + 1 - count, last], check_finite=False
    )
    inverse, Y = inverse[::-1], Y[:, ::-1]
    if inverse[-1] <= 0.0:
        return None
    return 1.0 / inverse, scale[:, None] * (T @ Y) / np.sqrt(inverse)
