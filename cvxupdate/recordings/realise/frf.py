"""Real modes straight from FRFs: the route of Chen, Hsu and Tsuei. `normal_frf` is (2.26 to
2.29), `normal_poles` its modes, `resonance_shapes` (2.30 to 2.32), `chen_hsu_tsuei` the crossings
of the whole band (2.24, 2.25)."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real


def normal_frf(H: Complex) -> Real:
    """Receptances (lines, n, p) of the undamped structure from those of the damped one,
    ``Re H + Im H (Re H)^+ Im H`` (2.26 to 2.29; of a square H the inverse).

    ``H`` (lines, n, p) of n responses to p <= n forces. Exact at every frequency, for viscous or
    hysteretic damping of any size, when all degrees of freedom that move are responses and forces:
    ``(Re H + Im H Re H^-1 Im H)^-1 = Re(H^-1)``; likewise when no more modes act than there are
    forces. With fewer forces it takes the smallest G = ``-Im H (Re H)^+`` that fits, and a pole may
    be lost.

    Raises
    ------
    RecordingError
        When there are more forces than responses.
    """
    if H.ndim != 3 or H.shape[1] < H.shape[2]:
        raise RecordingError(
            "the normal FRF needs at least as many responses as forces at each line, got "
            f"{H.shape[1:]}"
        )
    G = -H.imag @ np.linalg.pinv(H.real)
    return np.asarray(H.real - G @ H.imag)


def normal_poles(frequency: Real, H: Real) -> tuple[Real, Real]:
    """Natural frequencies (Hz) and real shapes (modes, n) of undamped receptances (lines, n, p), as
    `normal_frf` gives them.

    Between two lines next to a pole the receptances change sign through infinity: with the
    singular vectors u and v of the larger one, ``1 / u^T H v`` is almost linear in omega² there,
    and its zero is the pole; the shape is u.
    """
    u, s, vt = np.linalg.svd(H, full_matrices=False)
    top = s[:, 0]
    w2 = (2.0 * np.pi * frequency) ** 2
    found: list[tuple[float, Real]] = []
    for a in range(frequency.size - 1):
        near, far = (a, a + 1) if top[a] >= top[a + 1] else (a + 1, a)
        beyond = 2 * near - far
        if 0 <= beyond < top.size and top[beyond] > top[near]:
            continue
        other = float(u[near, :, 0] @ H[far] @ vt[near, 0])
        if other >= 0.0:
            continue
        # the line through 1 / top > 0 and 1 / other < 0 vanishes at this fraction of the way
        at = w2[near] + other / (other - top[near]) * (w2[far] - w2[near])
        found.append((float(np.sqrt(at)) / (2.0 * np.pi), u[near, :, 0]))
    return np.array([f for f, _ in found]), np.array([x for _, x in found]).reshape(-1, H.shape[1])


def normal_stiffness(H: Complex) -> Real:
    """Real part of the dynamic stiffness, ``Re(H^-1) = K - w² M`` of the undamped structure,
    (lines, n, n)."""
    if H.ndim != 3 or H.shape[1] != H.shape[2]:
        raise RecordingError(
            f"the dynamic stiffness needs a square matrix at each line, got {H.shape}"
        )
    return np.asarray(np.linalg.inv(H).real)


def chen_hsu_tsuei(frequency: Real, H: Complex) -> tuple[Real, Real]:
    """Undamped natural frequencies (Hz) and real shapes (modes, n) from square receptances over a
    band.

    The eigenvalues of the real dynamic stiffness (the inverse of the normal FRF, 2.28) cross zero
    at the undamped frequencies; the eigenvector there is the normal mode. Crossings are found
    between neighbouring lines and placed by linear interpolation along ``omega²``, so only FRFs
    next to resonance are used, as in the original (2.24, 2.25). H must be receptance (use
    `convert`). Assumes that every significant degree of freedom is measured and forced; see
    `normal_frf`.
    """
    values, vectors = np.linalg.eigh(
        0.5 * (normal_stiffness(H) + normal_stiffness(H).transpose(0, 2, 1))
    )
    w2 = (2.0 * np.pi * frequency) ** 2
    # K - w² M loses one positive eigenvalue at each natural frequency (Sylvester): the sorted k-th
    # eigenvalue crosses downward
    found: list[tuple[float, Real]] = []
    for line in range(frequency.size - 1):
        for k in np.flatnonzero((values[line] > 0.0) & (values[line + 1] <= 0.0)):
            a, b = values[line, k], values[line + 1, k]
            fraction = float(a / (a - b))
            at = w2[line] + fraction * (w2[line + 1] - w2[line])
            u, v = vectors[line, :, k], vectors[line + 1, :, k]
            shape = (1.0 - fraction) * u + fraction * (v if float(u @ v) >= 0.0 else -v)
            found.append((float(np.sqrt(at)) / (2.0 * np.pi), shape / np.linalg.norm(shape)))
    found.sort(key=lambda item: item[0])
    return np.array([f for f, _ in found]), np.array([s for _, s in found]).reshape(-1, H.shape[1])


def resonance_shapes(H: Complex, responses: Complex) -> Real:
    """Real shapes (modes, n) from responses at resonance, ``(I + G²) Re x`` with ``G = -Im H (Re
    H)^+`` (2.30 to 2.32).

    ``H`` (modes, n, p) holds the receptances at each natural frequency, ``responses`` (modes, n)
    the response there, ``x = H f`` to any real force f. As ``x_R = (I + i G) x`` is real, ``Im x =
    -G Re x``. The print writes (I + Im H)² Re H^2+, which has no dimension (errata). Only the FRFs
    at resonance are needed. Exact when all degrees of freedom that move are in the matrix; with
    fewer forces than responses G is the smallest that fits, and with fewer coordinates the damping
    must be light.

    Raises
    ------
    RecordingError
        When H and the responses do not belong together.
    """
    if H.ndim != 3 or responses.shape != H.shape[:2]:
        raise RecordingError(
            f"FRFs of shape {H.shape} at resonance need responses of shape {H.shape[:2]}, got "
            f"{responses.shape}"
        )
    out = np.empty(responses.shape)
    for k, (h, x) in enumerate(zip(H, responses, strict=True)):
        G = -h.imag @ np.linalg.pinv(h.real, rcond=1e-10)
        out[k] = x.real + G @ (G @ x.real)
    return out
