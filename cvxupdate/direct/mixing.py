"""Matrix mixing: M⁻¹ = Φ Φᵀ and K⁻¹ = Φ Λ⁻¹ Φᵀ from measured and filled-in modes (2.86 to 2.88)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def thoren(Phi: Real, eigenvalues: Real) -> DirectUpdate:
    """As many modes as DOFs (Thoren 1972): M = Φ⁻ᵀ Φ⁻¹, K = Φ⁻ᵀ Λ Φ⁻¹ (2.86).

    Phi : (n, n), unit modal mass; eigenvalues : (n,) λ = ω². Raises InputError for another shape or
    dependent modes.
    """
    if Phi.ndim != 2 or Phi.shape[0] != Phi.shape[1]:
        raise InputError(
            f"thoren: needs as many modes as DOFs, got shapes {Phi.shape}. Keep fewer DOFs, "
            "or use luk or caesar_link."
        )
    check(len(Phi), Phi, eigenvalues)
    if np.linalg.cond(Phi) > 1e13:
        raise InputError(
            "thoren: the modes are linearly dependent at these DOFs. Choose other DOFs."
        )
    Pi = la.inv(Phi)
    return DirectUpdate(
        "Thoren", symmetric(Pi.T @ Pi), symmetric(Pi.T @ (eigenvalues[:, None] * Pi))
    )


def ross(Phi: Real, eigenvalues: Real, fill: Real, fill_eigenvalues: Real) -> DirectUpdate:
    """Measured modes and linearly independent vectors that make the modal matrix square (Ross
    1971).

    fill : (N, N − m), e.g. an orthonormal complement; fill_eigenvalues : (N − m,), the eigenvalues
    given to them.
    """
    update = thoren(np.column_stack([Phi, fill]), np.concatenate([eigenvalues, fill_eigenvalues]))
    return DirectUpdate("Ross", update.M, update.K)


def luk(Phi: Real, eigenvalues: Real) -> DirectUpdate:
    """Pseudo-inverses of fewer modes than DOFs (Luk 1987): M = Φ⁺ᵀ Φ⁺, K = Φ⁺ᵀ Λ Φ⁺; both have the
    rank of Φ, so motions outside it weigh nothing."""
    check(len(Phi), Phi, eigenvalues)
    P = la.pinv(Phi)
    return DirectUpdate("Luk", symmetric(P.T @ P), symmetric(P.T @ (eigenvalues[:, None] * P)))


def caesar_link(
    K: Real, M: Real, Phi: Real, eigenvalues: Real, partners: NDArray[np.int64] | None = None
) -> DirectUpdate:
    """Measured modes in place of their partners among the model's own (Caesar 1987; Link 1987;
    2.87, 2.88).

    Phi : (N, m), unit modal mass; partners : (m,) the model's modes that they replace (0 = lowest,
    rigid-body modes counted), None for the first m. Built from the modal matrix, so K may be
    singular. Raises InputError when the mixed modes are dependent.
    """
    check(len(M), Phi, eigenvalues)
    values, vectors = la.eigh(K, M)
    where = np.arange(Phi.shape[1]) if partners is None else partners
    if len(set(where.tolist())) != Phi.shape[1] or where.min() < 0 or where.max() >= len(M):
        raise InputError(
            f"caesar_link: {Phi.shape[1]} measured modes need as many different partners "
            f"between 0 and {len(M) - 1}."
        )
    values, vectors = values.copy(), vectors.copy()
    values[where], vectors[:, where] = eigenvalues, Phi
    update = thoren(vectors, values)
    return DirectUpdate("Caesar and Link", update.M, update.K)
