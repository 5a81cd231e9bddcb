"""Real modes from the real subspace of the complex ones: Zhang and Lallement, Wei and Zhang,
Ibrahim and Fullekrug.

All three take the normal modes to be real combinations of m real vectors B that carry the complex
ones, ``psi = B q``, and solve the reduced, complete system ``[A0 A1] [q; q lambda] = -q lambda²``
for the real ``A0 = M^-1 K`` there (2.22 in m coordinates). They differ in B. ``poles`` (modes,)
rad/s, ``shapes`` (modes, channels) of viscous modes; results are frequencies (Hz) and shapes
(modes, channels). The thesis names the methods without equations; these are derived from what it
says of them. Exact when there are as many modes as channels; else as far as the normal modes lie in
the span of B, which heavy damping or a truncated set breaks (Sestieri & Ibrahim 1993).
"""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.realise.state import normal_modes_of
from cvxupdate.recordings.types import Complex, Real

SWEEPS = 200


def _checked(poles: Complex, shapes: Complex) -> Complex:
    """The shapes as columns, each turned to its axis and of unit length."""
    if poles.size > shapes.shape[1]:
        raise RecordingError(
            f"{poles.size} modes but {shapes.shape[1]} channels: a real subspace needs at least "
            "as many channels as modes; use fewer modes"
        )
    z = rotated(shapes).T
    return np.asarray(z / np.linalg.norm(z, axis=0))


def _reduced(poles: Complex, psi: Complex, basis: Real) -> tuple[Real, Real]:
    """Normal modes in the span of ``basis`` (channels, modes)."""
    q = np.linalg.lstsq(basis, psi, rcond=None)[0]
    scale = float(np.mean(np.abs(poles)))
    s = poles / scale
    top = np.concatenate([q, q * s])
    right = -q * s**2
    lhs, rhs = np.hstack([top.real, top.imag]), np.hstack([right.real, right.imag])
    if np.linalg.cond(lhs) > 1e12:
        raise RecordingError(
            "the modes do not determine M⁻¹K in their own subspace: shapes are dependent, or "
            "one is repeated; leave it out"
        )
    both = np.linalg.solve(lhs.T, rhs.T).T
    frequency, real = normal_modes_of(both[:, : poles.size] * scale**2, poles.size)
    return frequency, np.asarray(real @ basis.T)


def zhang_lallement(poles: Complex, shapes: Complex) -> tuple[Real, Real]:
    """B is the real part of the turned shapes (Zhang & Lallement 1985): the complex modes are
    linear combinations of as many normal ones.

    Raises
    ------
    RecordingError
        When there are more modes than channels, or the modes are dependent.
    """
    psi = _checked(poles, shapes)
    return _reduced(poles, psi, np.asarray(psi.real))


def wei_zhang(
    poles: Complex, shapes: Complex, *, sweeps: int = SWEEPS, tolerance: float = 1e-10
) -> tuple[Real, Real]:
    """B is found by iteration (Wei et al. 1987): from an assumed transformation the complex shapes
    are expressed in it, and the transformation is fitted to them again, until it stays.

    Each half of a sweep is a least-squares problem, so the misfit ``‖psi - B q‖`` cannot grow.
    Raises as `zhang_lallement`.
    """
    psi = _checked(poles, shapes)
    basis, before = np.linalg.qr(psi.real)[0], np.inf
    for _ in range(sweeps):
        q = np.linalg.lstsq(basis, psi, rcond=None)[0]
        misfit = float(np.linalg.norm(psi - basis @ q))
        if before - misfit < tolerance:
            break
        before = misfit
        both = np.hstack([q.real, q.imag])
        target = np.hstack([psi.real, psi.imag])
        basis = np.linalg.qr(np.linalg.lstsq(both.T, target.T, rcond=None)[0].T)[0]
    return _reduced(poles, psi, np.asarray(basis))


def ibrahim_fullekrug(poles: Complex, shapes: Complex) -> tuple[Real, Real]:
    """B is the left singular vectors of ``[Re psi, Im psi]`` (Ibrahim & Fullekrug 1990): the real
    subspace of m dimensions nearest to the complex shapes, without iteration.

    Raises as `zhang_lallement`.
    """
    psi = _checked(poles, shapes)
    U = np.linalg.svd(np.hstack([psi.real, psi.imag]), full_matrices=False)[0]
    return _reduced(poles, psi, np.asarray(U[:, : poles.size]))
