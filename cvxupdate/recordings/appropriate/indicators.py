"""Curves over frequency whose zeros or minima are undamped natural frequencies: (2.35) to
(2.44).

``H`` is (lines, responses, exciters), receptance or accelerance (for a mobility multiply by ``i
omega`` first: `convert`). Each function gives eigenvalues (lines, exciters), ascending, and real
force vectors (lines, exciters, exciters), a column per eigenvalue.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real


def _square(H: Complex, method: str) -> Complex:
    if H.ndim != 3 or H.shape[1] != H.shape[2]:
        raise RecordingError(
            f"{method} needs responses at the exciters and nowhere else (a square matrix), "
            f"got {H.shape}; use mmif for more responses than exciters"
        )
    return np.asarray(0.5 * (H + H.transpose(0, 2, 1)))


def _definite(A: Real, B: Real) -> tuple[Real, Real]:
    """Generalised symmetric eigenproblem line by line; directions in which noise makes B indefinite
    are floored."""
    level, axes = np.linalg.eigh(B)
    level = np.maximum(level, 1e-13 * np.abs(level).max(axis=1, keepdims=True) + 1e-300)
    whiten = axes / np.sqrt(level)[:, None, :]
    values, vectors = np.linalg.eigh(whiten.transpose(0, 2, 1) @ A @ whiten)
    vectors = whiten @ vectors
    return values, vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _share(part: Real, rest: Real) -> tuple[Real, Real]:
    """``part^T part f = beta (part^T part + rest^T rest) f`` without squaring: cosines of the QR
    factor (generalised SVD)."""
    Q, T = np.linalg.qr(np.concatenate([part, rest], axis=1))
    _, cosine, Vt = np.linalg.svd(
        Q[:, : part.shape[1]], full_matrices=part.shape[1] < part.shape[2]
    )
    beta = np.zeros((part.shape[0], part.shape[2]))
    beta[:, : cosine.shape[1]] = np.clip(cosine, 0.0, 1.0) ** 2
    # a force that moves nothing has no fraction: its direction is kept finite
    diagonal = np.abs(np.einsum("fii->fi", T))
    floor = 1e-14 * diagonal.max(axis=1, keepdims=True) + 1e-300
    T = T + np.eye(T.shape[1]) * np.where(diagonal < floor, floor, 0.0)[:, None, :]
    vectors = np.linalg.solve(T, Vt.transpose(0, 2, 1))[:, :, ::-1]
    return beta[:, ::-1], np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def asher(H: Complex) -> tuple[Real, Real]:
    """Asher: determinant of Re H (2.37), scaled to its geometric mean eigenvalue with the sign
    kept, (lines, 1).

    The force vectors are those of the smallest \\|eigenvalue\\|, (lines, exciters, 1). Assumes
    square FRFs, as many exciters as active modes, and proportional damping for exactly pure modes;
    surplus exciters make the determinant vanish everywhere.
    """
    values, vectors = np.linalg.eigh(_square(H, "Asher's method").real)
    size = np.exp(np.mean(np.log(np.maximum(np.abs(values), 1e-300)), axis=1))
    signed = np.prod(np.sign(values), axis=1) * size
    least = np.argmin(np.abs(values), axis=1)
    return signed[:, None], np.take_along_axis(vectors, least[:, None, None], axis=2)


def modified_asher(H: Complex) -> tuple[Real, Real]:
    """Modified Asher: ``Re H f = lambda f`` (2.38; Alexiou & Wright 1985); lambda is zero at
    natural frequencies.

    Assumes a square (reciprocal) FRF matrix; does not need as many modes as exciters.
    """
    values, vectors = np.linalg.eigh(_square(H, "the modified Asher method").real)
    return values, vectors


def traill_nash(H: Complex) -> tuple[Real, Real]:
    """Traill-Nash: ``Re H f = mu Im H f`` (2.39; Alexiou & Wright 1987); mu is zero at natural
    frequencies.

    Assumes a square FRF matrix whose quadrature part is definite: as many active modes as exciters
    (reduce the forces with `principal_forces` first). Exact in frequency for any damping when all
    active degrees of freedom are driven.
    """
    square = _square(H, "the Traill-Nash method")
    sign = np.sign(np.trace(square.imag, axis1=1, axis2=2))
    values, vectors = _definite(square.real, sign[:, None, None] * square.imag)
    return values * sign[:, None], vectors


def extended_asher(H: Complex) -> tuple[Real, Real]:
    """Extended Asher: ``Re H^T Re H f = alpha f`` (2.41; Ibanez & Blakely 1984); minima of alpha,
    for any number of responses.

    Assumes forces of equal worth: alpha has the unit of H² and falls between resonances too, where
    the structure hardly moves; with as many exciters as modes its minima are far narrower than the
    resonances and need fine lines.
    """
    _, s, Vt = np.linalg.svd(H.real, full_matrices=H.shape[1] < H.shape[2])
    alpha = np.zeros((H.shape[0], H.shape[2]))
    alpha[:, : s.shape[1]] = s**2
    return alpha[:, ::-1], Vt.transpose(0, 2, 1)[:, :, ::-1]


def mmif(H: Complex) -> tuple[Real, Real]:
    """Multivariate mode indicator: ``R^T R f = beta (R^T R + I^T I) f`` (2.43 corrected; Williams &
    Crowley 1986).

    beta lies in [0, 1], 0 at a pure mode; a second curve that dips at the same place says that
    there are two modes. Assumes nothing about the number of responses; for non-proportional damping
    the dip does not reach 0.
    """
    values, vectors = _share(H.real, H.imag)
    return values, vectors


def nash(H: Complex) -> tuple[Real, Real]:
    """Nash's variant: the fraction in quadrature, ``I^T I f = gamma (R^T R + I^T I) f`` (2.44; Nash
    1991); maxima (1 = pure mode).

    gamma = 1 - beta with the same forces as `mmif`; made for principal forces (`principal_forces`)
    when there are many exciters.
    """
    values, vectors = _share(H.imag, H.real)
    return values, vectors


def principal_forces(H: Complex, *, count: int | None = None, tolerance: float = 0.02) -> Real:
    """Orthonormal force vectors that move the structure, strongest first, (exciters, kept): SVD of
    all lines stacked.

    Keeps ``count`` of them, or those with a singular value above ``tolerance`` times the largest
    (Juang & Wright 1991; Otte 1993). Use ``H @ V`` in place of H and ``V f`` as the physical
    forces: it removes the ill-conditioning of surplus exciters.
    """
    stacked = np.concatenate([H.real.reshape(-1, H.shape[2]), H.imag.reshape(-1, H.shape[2])])
    _, s, Vt = np.linalg.svd(stacked, full_matrices=False)
    kept = int(np.count_nonzero(s > tolerance * s[0])) if count is None else count
    return np.asarray(Vt[:kept].T)
