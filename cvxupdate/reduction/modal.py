"""Transformations from the model's own mode shapes: SEREP, SEREPa, TAM, hybrid TAM."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import solve

from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction.split import Array, Index, master_rows
from cvxupdate.reduction.transformation import Transformation

# Modes that the masters see with a worse condition than this cannot be distinguished in double
# precision.
_WORST_CONDITION = 1e10


def serep(phi: Array, masters: Index) -> Transformation:
    """SEREP (O'Callahan et al. 1989): T = Φ Φ_n⁺, from r ≤ n modes of the full model (2.57, 2.69).

    The reduced model has exactly these r modes; expansion projects the measured values on them (it
    smooths).

    Parameters
    ----------
    phi : (N, r) mode shapes, of any scale. masters : (n,) rows.

    Raises
    ------
    InputError
        More modes than masters. ModelError: the masters cannot distinguish the modes (Φ_n is rank
        deficient).
    """
    n, phi = _at_masters(phi, masters, "SEREP")
    return Transformation(phi @ np.linalg.pinv(phi[n]), n, "SEREP")


def tam(phi: Array, masters: Index) -> Transformation:
    """Test-analysis model (Kammer 1987): SEREP at the slaves, the masters as measured (2.71).
    Raises as `serep`."""
    n, phi = _at_masters(phi, masters, "TAM")
    T = phi @ np.linalg.pinv(phi[n])
    T[n] = np.eye(n.size)
    return Transformation(T, n, "TAM")


def serepa(phi: Array, masters: Index) -> Transformation:
    """SEREPa (O'Callahan & Li 1990): as many modes as masters, so that Φ_nn is inverted and nothing
    smoothed (2.70).

    ``phi`` is (N, n). Raises `InputError` when the number of modes is not the number of masters,
    else as `serep`.
    """
    n, phi = _at_masters(phi, masters, "SEREPa")
    if phi.shape[1] != n.size:
        raise InputError(
            f"SEREPa: needs as many modes as masters, got {phi.shape[1]} and {n.size}; "
            "give more modes, or use TAM"
        )
    T = np.linalg.solve(phi[n].T, phi.T).T
    T[n] = np.eye(n.size)
    return Transformation(T, n, "SEREPa")


def hybrid_tam(phi: Array, M: Any, static: Transformation) -> Transformation:
    """Hybrid TAM (Kammer 1991): TAM on the motion of the modes, Guyan on what is left (2.72 as
    corrected).

    T₈ = T₁ + (T₇ − T₁) Q, Q = Φ_n (Φ_nᵀ W Φ_n)⁻¹ Φ_nᵀ W, W = T₇ᵀ M T₇. Because T₇Φ_n = Φ, Φ_nᵀWΦ_n
    is the modal mass (I for mass-normalised shapes, which gives the corrected print Q = Φ_nΦ_nᵀW).
    Q is the oblique projector on the modes at the masters: T₈ expands every combination of the
    modes exactly, as TAM does, and motion W-orthogonal to them as Guyan does.

    Parameters
    ----------
    phi : (N, r) modes. M : (N, N) mass matrix. static : the Guyan transformation T₁ on the same
    masters.
    Raises as `serep`.
    """
    modal = tam(phi, static.masters)
    at_masters = _at_masters(phi, static.masters, "hybrid TAM")[1][static.masters]
    weighted = at_masters.T @ modal.reduce(M)
    Q = at_masters @ solve(weighted @ at_masters, weighted)
    return Transformation(
        static.matrix + (modal.matrix - static.matrix) @ Q, static.masters, "hybrid TAM"
    )


def _at_masters(phi: Array, masters: Index, method: str) -> tuple[Index, Array]:
    """The rows of the masters, and the modes scaled to unit length there; the checks that `serep`
    documents."""
    if phi.ndim != 2 or not np.all(np.isfinite(phi)):
        raise InputError(f"{method}: phi must be (N, modes) and finite, got shape {phi.shape}")
    n = master_rows(masters, phi.shape[0])
    if phi.shape[1] > n.size:
        raise InputError(
            f"{method}: {phi.shape[1]} modes cannot be distinguished by {n.size} masters; "
            "keep at most as many modes as masters"
        )
    # Columns are brought to one scale first: nothing may depend on how the modes were normalised.
    length = np.linalg.norm(phi[n], axis=0)
    whole = np.linalg.norm(phi, axis=0)
    condition = float(np.linalg.cond(phi[n] / length)) if np.all(length > 1e-12 * whole) else np.inf
    if condition > _WORST_CONDITION:
        raise ModelError(
            f"{method}: the {n.size} masters cannot distinguish the {phi.shape[1]} modes "
            f"(condition number {condition:.2g}); move or add masters (see visibility), or "
            "keep fewer modes"
        )
    return n, phi / length
