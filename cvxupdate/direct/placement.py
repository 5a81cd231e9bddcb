"""Pole placement (section 2.7.4; Porter and Crossley 1972): measured frequencies alone are
assigned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.least_change import check, symmetric
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]


def pole_placement(
    K: Real, M: Real, own: Real, own_eigenvalues: Real, eigenvalues: Real
) -> DirectUpdate:
    """K_U = K + M Φ_A (Λ_X − Λ_A) Φ_Aᵀ M: one actuator and one output on each mode (2.96).

    Every mode keeps its shape, those that are not placed their frequencies as well. By the theorem
    of Hoffman and Wielandt no other symmetric change of K that moves these eigenvalues alone is
    smaller in ‖M^-½ ΔK M^-½‖.

    Parameters
    ----------
    K, M : (N, N); own : (N, m) the model's modes that are moved, unit modal mass, with
    ``own_eigenvalues`` (m,) λ = ω²; eigenvalues : (m,) where they are to lie.
    """
    check(len(M), own, own_eigenvalues)
    check(len(M), own, eigenvalues)
    B = M @ own
    return DirectUpdate(
        "Pole placement",
        M.copy(),
        symmetric(K + (B * (eigenvalues - own_eigenvalues)[None, :]) @ B.T),
    )


def modal_control(
    K: Real, M: Real, own: Real, own_eigenvalues: Real, eigenvalues: Real
) -> DirectUpdate:
    """K_U = K + b gᵀ (2.96) with g of `single_input` and one actuator b = M Φ_A 1, which drives all
    the modes alike: every other frequency stays, symmetry does not."""
    b = M @ own.sum(axis=1)
    g = single_input(M, own, own_eigenvalues, eigenvalues, b)
    return DirectUpdate("Modal control", M.copy(), K + np.outer(b, g))


def single_input(M: Real, own: Real, own_eigenvalues: Real, eigenvalues: Real, b: Real) -> Real:
    """The gain g (N,) of one actuator ``b`` (N,) for which K + b gᵀ has ``eigenvalues`` in place of
    ``own_eigenvalues``, and every other of the model's where it was by the
    modal control of Porter and Crossley (2.95). Not symmetric, and the shapes move.

    Raises
    ------
    InputError
        When ``b`` does not drive a mode that is to move, or two of them have one frequency.
    """
    check(len(M), own, own_eigenvalues)
    check(len(M), own, eigenvalues)
    drive = own.T @ b
    if np.any(np.abs(drive) <= 1e-12 * np.linalg.norm(b) * np.linalg.norm(own, axis=0)):
        raise InputError("pole placement: the actuator stands on a node of a mode. Move it.")
    gap = own_eigenvalues[:, None] - own_eigenvalues[None, :]
    np.fill_diagonal(gap, 1.0)
    if np.any(gap == 0.0):
        raise InputError(
            "pole placement: one actuator cannot move two modes of one frequency apart. Leave one "
            "out, or take the symmetric form."
        )
    # The characteristic polynomial of diag(λ) + drive γᵀ is that of ρ: its residues at each λ_j.
    # Factors in pairs, so that products of many large differences neither over- nor underflow.
    away = own_eigenvalues[:, None] - eigenvalues[None, :]
    diagonal = np.diag(away).copy()
    ratio = away / gap
    np.fill_diagonal(ratio, 1.0)
    gamma = -diagonal * np.prod(ratio, axis=1) / drive
    return np.asarray(M @ own @ gamma)
