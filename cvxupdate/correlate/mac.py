"""Mode shapes against mode shapes: MAC, its overall error, modal scale factor, COMAC.

Shapes are (dofs, modes), real or complex, of any scale; NaN marks a channel that was not measured,
and is left out of every pair of vectors that it touches.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.correlate._shapes import Real, Shapes, masked_pairs, same_dofs, same_pairs
from cvxupdate.errors import InputError


def mac(phi_a: Shapes, phi_x: Shapes) -> Real:
    """Modal assurance criterion of every model mode with every measured mode.

    MAC_ij = |φ_Aiᴴ φ_Xj|² / (φ_Aiᴴφ_Ai · φ_Xjᴴφ_Xj): (2.4) with the modulus squared, which the
    print lacks (Allemang & Brown 1982). Between 0 and 1, whatever the scale and phase of either
    vector.

    Parameters
    ----------
    phi_a : (dofs, modes_a); phi_x : (dofs, modes_x). NaN where not measured: the sums run over the
    shared channels.

    Returns
    -------
    (modes_a, modes_x) array, dimensionless; 0 for a pair without any motion in common.

    Raises
    ------
    InputError
        The numbers of DOFs differ.
    """
    a, x = same_dofs(phi_a, phi_x)
    seen_a, seen_x = ~np.isnan(a), ~np.isnan(x)
    a, x = unit(np.where(seen_a, a, 0.0)), unit(np.where(seen_x, x, 0.0))
    cross = np.abs(a.conj().T @ x) ** 2
    norms = ((np.abs(a) ** 2).T @ seen_x) * (seen_a.T.astype(np.float64) @ np.abs(x) ** 2)
    return np.minimum(np.divide(cross, norms, out=np.zeros_like(cross), where=norms > 0.0), 1.0)


def paired_mac(phi_a: Shapes, phi_x: Shapes) -> Real:
    """MAC of paired columns only, shape (modes,): the diagonal of `mac` without the rest. Raises as
    `comac` does."""
    a, x = masked_pairs(*same_pairs(phi_a, phi_x))
    a, x = unit(a), unit(x)
    cross = np.abs(np.sum(a.conj() * x, axis=0)) ** 2
    norms = np.sum(np.abs(a) ** 2, axis=0) * np.sum(np.abs(x) ** 2, axis=0)
    return np.minimum(np.divide(cross, norms, out=np.zeros_like(cross), where=norms > 0.0), 1.0)


def mac_error(macs: Real) -> float:
    """Overall mode shape error in per cent, from the MACs of L paired modes: 100 (1 − √(ΣMAC²/L)).

    (2.5) in the form that is 0 for a perfect match (the print divides by L outside the root).
    Raises `InputError` for an empty list or values outside [0, 1].
    """
    values = np.asarray(macs, dtype=np.float64).ravel()
    if (
        values.size == 0
        or np.any(~np.isfinite(values))
        or values.min() < 0.0
        or values.max() > 1.0 + 1e-12
    ):
        raise InputError(
            "mac_error: needs at least one MAC, each between 0 and 1; pass the MACs of the "
            "paired modes"
        )
    return float(100.0 * max(0.0, 1.0 - np.sqrt(np.mean(values**2))))


def modal_scale_factor(phi_a: Shapes, phi_x: Shapes) -> Shapes:
    """The factor s that brings each model shape nearest to its measured one: φ_X ≈ s φ_A in least
    squares.

    s = φ_Aᴴ φ_X / (φ_Aᴴ φ_A), Allemang & Brown 1982; (2.3) prints its complex conjugate, which for
    complex shapes would scale neither vector onto the other.

    Parameters
    ----------
    phi_a, phi_x : (dofs, modes) paired columns, NaN where not measured.

    Returns
    -------
    (modes,) array, complex when either set is. Raises `InputError` when the sets are not paired or
    a model shape
    does not move at any channel measured.
    """
    a, x = masked_pairs(*same_pairs(phi_a, phi_x))
    energy = np.sum(np.abs(a) ** 2, axis=0)
    if np.any(energy == 0.0):
        still = (np.flatnonzero(energy == 0.0) + 1).tolist()
        raise InputError(
            f"modal_scale_factor: model shapes {still} do not move at the measured channels; "
            "leave them out"
        )
    return np.asarray(np.sum(a.conj() * x, axis=0) / energy)


def comac(phi_a: Shapes, phi_x: Shapes) -> Real:
    """Coordinate MAC of every DOF over the paired modes (Lieven & Ewins 1988; 2.6 with squared
    moduli).

    COMAC_i = |Σ_r |φ_A,ir φ_X,ir*||² / (Σ_r|φ_A,ir|² Σ_r|φ_X,ir|²). The modulus of each product is
    taken *before* the sum, so that the arbitrary sign of each mode does not matter; the print
    squares inside the sum, which cannot reach 1 for more than one mode. Every pair is first brought
    to unit length over its shared channels, so that no mode's scaling outweighs the others.

    Parameters
    ----------
    phi_a, phi_x : (dofs, modes) paired columns, NaN where not measured.

    Returns
    -------
    (dofs,) array between 0 and 1; NaN at a DOF without motion or never measured. Raises
    `InputError` when the sets
    are not paired.
    """
    a, x = masked_pairs(*same_pairs(phi_a, phi_x))
    a, x = unit(a), unit(x)
    top = np.sum(np.abs(a * x), axis=1) ** 2
    bottom = np.sum(np.abs(a) ** 2, axis=1) * np.sum(np.abs(x) ** 2, axis=1)
    return np.minimum(
        np.divide(top, bottom, out=np.full_like(top, np.nan), where=bottom > 0.0), 1.0
    )


def unit(phi: Shapes) -> Shapes:
    """Columns of unit Euclidean length; a zero column stays zero. The peak goes first, so that
    nothing overflows."""
    peak = np.max(np.abs(phi), axis=0, initial=0.0)
    scaled = phi / np.where(peak > 0.0, peak, 1.0)
    length = np.sqrt(np.sum(np.abs(scaled) ** 2, axis=0))
    return np.asarray(scaled / np.where(length > 0.0, length, 1.0))
