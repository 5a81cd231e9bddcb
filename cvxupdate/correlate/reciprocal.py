"""Measured shapes against reciprocal modal vectors from measured FRFs: no model, no mass matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real, Shapes, as_columns
from cvxupdate.errors import InputError

Complex = NDArray[np.complex128]

# What a measured quantity is divided by, as a function of ω, to become a displacement.
_TO_RECEPTANCE = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True)
class ReciprocalVectors:
    """``vectors`` (n, modes), ψ_rᵀφ_r = 1; ``orthogonality`` (modes, modes), |ψ_rᵀφ_s| with every φ
    of one length: I is perfect.

    ``fit`` (modes,): the relative residual of ψ_rᵀH against one degree of freedom, 0 where the
    channels separate the mode from all others, near 1 where they do not.
    """

    vectors: Complex
    orthogonality: Real
    fit: Real


def reciprocal_vectors(
    frequency: Real,
    H: Complex,
    phi_x: Shapes,
    f_x: Real,
    loss: Real | None = None,
    quantity: str = "displacement",
    rcond: float = 1e-6,
) -> ReciprocalVectors:
    """Reciprocal modal vectors from FRFs, and how orthogonal the identified shapes are to them.

    He & Imregun (1995) test identified shapes against vectors that come from the FRFs alone;
    Imregun & Ewins (1996) add structural damping. Derivation used here: a receptance column is
    h_j(ω) = Σ_s φ_s φ_js / (λ_s(1 + iη_s) − ω²), so the vector with ψ_rᵀφ_s = δ_rs turns it into
    one degree of freedom, ψ_rᵀh_j(ω) = φ_jr / (λ_r(1 + iη_r) − ω²). That is linear in ψ_r and
    solved over all lines and references by least squares, every line divided by its length (FRFs
    have a relative error, and a peak must not outvote a mode that is weakly driven). The shapes φ
    are used only afterwards, so wrong shapes show as |ψ_rᵀφ_s| ≠ δ_rs. The two papers were not at
    hand; this is their idea, derived anew.

    Parameters
    ----------
    frequency : (lines,) Hz. H : (lines, n, references) in SI per newton, or (lines, n) for one
    reference. The modal
    constants φ_jr of the references are unknowns too: a reference need not be one of the responses.
    phi_x : (n, modes) identified shapes. f_x : (modes,) Hz. loss : (modes,) structural loss factor
    η (2ζ for light
    viscous damping), zeros when None. quantity : of the response. rcond : singular values of the
    stacked FRFs below
    rcond times the largest are noise and cut off.

    Raises
    ------
    InputError
        Shapes do not agree, the quantity is unknown, or fewer lines than channels are left.
    """
    phi, f = as_columns(phi_x, "phi_x"), np.asarray(f_x, dtype=np.float64)
    Hs = H[:, :, None] if H.ndim == 2 else H
    eta = np.zeros(f.size) if loss is None else np.asarray(loss, dtype=np.float64)
    _agree(frequency, Hs, phi, f, eta, quantity)
    usable = (
        (frequency > 0.0)
        & np.all(np.isfinite(Hs), axis=(1, 2))
        & np.all(np.any(Hs != 0.0, axis=1), axis=1)
    )
    omega = 2.0 * np.pi * frequency[usable]
    receptance = Hs[usable] / (1j * omega[:, None, None]) ** _TO_RECEPTANCE[quantity]
    if omega.size * Hs.shape[2] < phi.shape[0] or np.any(np.isnan(phi)):
        raise InputError(
            f"reciprocal vectors: {omega.size} usable lines cannot determine {phi.shape[0]} "
            "channels; give more lines, and shapes without gaps"
        )
    pole = (2.0 * np.pi * f) ** 2 * (1.0 + 1j * eta)
    return _solve(receptance, omega, pole, phi, rcond)


def _agree(frequency: Real, H: Complex, phi: Shapes, f: Real, eta: Real, quantity: str) -> None:
    """Raise `InputError` unless the arrays fit together and the quantity is a motion."""
    if quantity not in _TO_RECEPTANCE:
        raise InputError(
            f"reciprocal vectors: quantity must be one of {sorted(_TO_RECEPTANCE)}, got "
            f"{quantity!r}"
        )
    if (
        H.shape[:2] != (frequency.size, phi.shape[0])
        or f.shape != (phi.shape[1],)
        or eta.shape != f.shape
    ):
        raise InputError(
            f"reciprocal vectors: H {H.shape}, {frequency.size} lines, shapes {phi.shape}, "
            f"{f.size} frequencies do not agree"
        )


def _solve(
    receptance: Complex, omega: Real, pole: Complex, phi: Shapes, rcond: float
) -> ReciprocalVectors:
    lines, n, references = receptance.shape
    weight = 1.0 / np.linalg.norm(receptance, axis=1)
    rows = (receptance * weight[:, None, :]).transpose(2, 0, 1).reshape(references * lines, n)
    U, sigma, Vh = np.linalg.svd(rows, full_matrices=False)
    kept = sigma > rcond * sigma[0]
    U, inverse = U[:, kept], (Vh[kept].conj().T / sigma[kept])
    vectors = np.empty((n, pole.size), dtype=np.complex128)
    fit = np.empty(pole.size)
    for r in range(pole.size):
        single = weight / (pole[r] - omega**2)[:, None]
        single = single / np.linalg.norm(single)
        basis = np.zeros((references * lines, references), dtype=np.complex128)
        for j in range(references):
            basis[j * lines : (j + 1) * lines, j] = single[:, j]
        lengths = np.linalg.norm(basis, axis=0)
        inside = U @ (U.conj().T @ (basis / lengths))
        # The combination of references whose target lies nearest to what the FRFs can form.
        _, _, Wh = np.linalg.svd(inside, full_matrices=False)
        best = Wh[0].conj()
        target = (basis / lengths) @ best
        vectors[:, r] = inverse @ (U.conj().T @ target)
        fit[r] = np.linalg.norm(rows @ vectors[:, r] - target) / np.linalg.norm(target)
    own = np.sum(vectors * phi, axis=0)
    if np.any(own == 0.0):
        raise InputError(
            "reciprocal vectors: a shape is orthogonal to its own reciprocal vector; check "
            "f_x and the shapes"
        )
    vectors = vectors / own
    length = np.linalg.norm(phi, axis=0)
    return ReciprocalVectors(
        vectors, np.abs(vectors.T @ phi) * length[:, None] / length[None, :], fit
    )
