"""Natural modes of a structure that has changed a little since its modes were known.

One factorisation of K and a few block inverse iterations with Rayleigh–Ritz in two Krylov blocks
(Bathe and Wilson 1972; Golub and Underwood 1977), begun with the modes before. The factors stay:
sensitivities of the shapes are solved with them (`cvxupdate.residual.nelson`).
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

ROUNDS = 12  # block iterations after which the modes are sought from nothing
EXACT = 1e-8  # sine of the angle that is left after the last round, estimated from two rounds
INDEPENDENT = 1e-13  # relative eigenvalue of a Gram matrix below which columns are rounding


@dataclass(frozen=True)
class Continued:
    """``modes`` of which the first ``exact`` have converged (the others are Ritz vectors), the
    ``factor`` of K, and M without stored zeros."""

    modes: Modes
    exact: int
    factor: Factored
    mass: sp.csc_array


def continued_modes(m: Matrices, before: Modes, wanted: int) -> Continued | None:
    """As many modes as ``before`` has, the lowest ``wanted`` of them exact to rounding.

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
    factor = factored(m.K, "the stiffness matrix")
    if factor.negatives() != 0:  # None: rows were exchanged, for a pivot was zero
        raise ModelError(
            "the stiffness matrix is not positive definite: a stiffness parameter has gone too "
            "far. Bound it from below."
        )
    M = m.M.copy()
    M.eliminate_zeros()  # K and M share a pattern, and M may be far emptier
    shapes, angle = before.shapes, 1.0
    for _ in range(ROUNDS):
        found = _round(factor, M, shapes)
        if found is None:
            return None
        turned = _angle(shapes, found[1][:, :wanted], M)
        (values, shapes), last, angle = found, angle, turned
        if angle * min(1.0, angle / last) <= EXACT:
            break
    else:
        return None
    if values[0] <= 0.0:
        return None
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    return Continued(Modes(values, shapes * np.where(largest < 0, -1.0, 1.0), 0), wanted, factor, M)


def _angle(old: Real, new: Real, M: sp.csc_array) -> float:
    """Sine of the largest angle between a column of ``new`` and the span of ``old``."""
    MO = M @ old
    inside = MO.T @ new
    seen = np.einsum("ij,ij->j", inside, la.solve(old.T @ MO, inside, assume_a="pos"))
    return float(np.sqrt(max(np.max(1.0 - seen), 1e-30)))


def _round(factor: Factored, M: sp.csc_array, X: Real) -> tuple[Real, Real] | None:
    """Ritz values and vectors in the span B of K⁻¹MX and (K⁻¹M)²X, as many as X (N, b) has columns;
    None where rounding leaves fewer directions.

    B = K⁻¹MP, so BᵀKB = BᵀMP: nothing is multiplied by K, whose large entries would leave rounding
    in the small eigenvalues.
    """
    P = np.hstack([X, np.zeros_like(X)])
    B = np.zeros_like(P)
    b = X.shape[1]
    for k in (0, b):
        solved = factor.solve(M @ P[:, k : k + b])
        scale = 1.0 / np.sqrt(np.einsum("ij,ij->j", solved, M @ solved))
        B[:, k : k + b] = solved * scale
        P[:, k : k + b] *= scale
        if k == 0:
            P[:, b:] = B[:, :b]
    MB = M @ B
    gram, H = B.T @ MB, P.T @ MB
    if not (np.all(np.isfinite(gram)) and np.all(np.isfinite(H))):
        return None
    weights, V = la.eigh(gram, check_finite=False)
    keep = weights > INDEPENDENT * weights[-1]
    if np.sum(keep) < b:
        return None
    T = V[:, keep] / np.sqrt(weights[keep])
    H = T.T @ H @ T
    values, Y = la.eigh((H + H.T) / 2.0, subset_by_index=[0, b - 1], check_finite=False)
    return values, B @ (T @ Y)
