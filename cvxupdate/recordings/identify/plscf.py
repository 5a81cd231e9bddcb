"""Poly-reference least-squares complex frequency domain (pLSCF): poles and participations for a
range of orders.

P. Guillaume, P. Verboven, S. Vanlanduit, H. Van der Auweraer, B. Peeters, "A poly-reference
implementation of the least-squares complex frequency-domain estimator", IMAC XXI (2003); B. Peeters
et al., Shock and Vibration 11 (2004) 395; bottom coefficient fixed so that mathematical poles are
unstable: B. Cauberghe et al., J. Vib. Control 11 (2005) 1199.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real

UNDAMPED = 1e-3
"""Damping ratio that noise makes of none: what two orders of the diagram may differ by anyway."""


@dataclass(frozen=True)
class PoleSet:
    """Poles of one model order: ``poles`` (n,) rad/s with positive imaginary part;
    ``participation`` (n, references)."""

    order: int
    poles: Complex
    participation: Complex


def _lags(basis_angle: Real, values: Complex, order: int) -> Real:
    """``Re sum_f values[f] exp(i angle_f k)`` for k = -order..order, (2 order + 1, columns): every
    Toeplitz entry there is."""
    k = np.arange(0, order + 1)
    phase = np.exp(1j * np.outer(k, basis_angle))
    positive = phase @ values
    # Re sum v conj(z)^k = Re sum conj(v) z^k
    negative = phase[1:] @ np.conj(values)
    return np.real(np.concatenate([negative[::-1], positive]))


def _blocks(order: int) -> NDArray[np.int64]:
    """Index of the lag ``s - r`` for all r, s = 0..order."""
    k = np.arange(order + 1)
    return np.asarray(k[None, :] - k[:, None] + order)


def reduced_normal_matrices(
    angle: Real, H: Complex, weights: Real, order: int
) -> tuple[Real, NDArray[np.float64], int]:
    """The pieces of the reduced normal equations at the largest order.

    ``angle`` (lines,) of z; ``H`` (lines, outputs, inputs); ``weights`` (lines, outputs). Returns
    T, the sum of ``Y^T Y`` over the outputs, (inputs (order+1))², and Q (outputs, order + 1, inputs
    (order + 1)) with ``S^T R^-1 S = sum_o Q^T Q``; since R is factored as ``L L^T`` the first n + 1
    rows of Q serve order n, so every lower order costs a sum and no new factorisation.
    """
    lines, outputs, inputs = H.shape
    squared = weights**2
    index = _blocks(order)
    size = order + 1
    weighted = squared[:, :, None] * H
    R = _lags(angle, squared.astype(np.complex128), order)
    S = -_lags(angle, weighted.reshape(lines, -1), order).reshape(-1, outputs, inputs)
    gram = np.einsum("foi,foj->fij", np.conj(weighted), H)
    T = _lags(angle, gram.reshape(lines, -1), order).reshape(-1, inputs, inputs)
    T_full = T[index].transpose(0, 2, 1, 3).reshape(size * inputs, size * inputs)
    Q = np.empty((outputs, size, size * inputs))
    for o in range(outputs):
        R_o = R[:, o][index]
        # a ridge of rounding size: R is singular in effect when lines are fewer than coefficients
        L = np.linalg.cholesky(R_o + 1e-13 * np.trace(R_o) / size * np.eye(size))
        Q[o] = scipy.linalg.solve_triangular(
            L, S[:, o][index].reshape(size, size * inputs), lower=True
        )
    return T_full, Q, inputs


def _poles_of(M: Real, order: int, inputs: int) -> tuple[Complex, Complex]:
    """Roots 1/z of det A(z) and the left null vectors of A there, (n,) and (inputs, n): the poles
    and their participations.

    A_order = I is fixed. Least squares puts the roots that only fit noise inside the unit circle of
    z = exp(-i w dt), that is outside the one of exp(s dt): they come out unstable and fall away.
    (A_0 = I would make them stable.)
    """
    size = order * inputs
    A = np.linalg.solve(M[:size, :size], -M[:size, size:]).reshape(order, inputs, inputs)
    companion = np.zeros((size, size))
    # for A^T: its right null vectors are the left ones of A, and H = B A^-1 has residues (B v) w^T
    companion[:inputs] = -A[::-1].transpose(2, 0, 1).reshape(inputs, size)
    companion[inputs:, :-inputs] = np.eye(size - inputs)
    values, vectors = np.linalg.eig(companion)
    return np.asarray(1.0 / np.where(np.abs(values) > 1e-12, values, np.inf)), np.asarray(
        vectors[-inputs:]
    )


def _in_time(values: Complex, step: float, origin: float) -> Complex:
    """Poles in s of those in z. Without damping noise puts one on either side of the axis."""
    with np.errstate(divide="ignore", invalid="ignore"):
        poles = np.log(values) / step + 2j * np.pi * origin
    near = np.abs(poles.real) < UNDAMPED * np.abs(poles)
    return np.asarray(np.where(near, -np.abs(poles.real) + 1j * poles.imag, poles))


def _even_weights(H: Complex) -> Real:
    """One over the r.m.s. of each output, (lines, outputs)."""
    level = np.sqrt(np.mean(np.abs(H) ** 2, axis=(0, 2)))
    return np.asarray(np.ones((len(H), 1)) / np.where(level > 0.0, level, np.inf))


def plscf(
    frequency: Real,
    H: Complex,
    *,
    orders: NDArray[np.int64],
    weights: Real | None = None,
    margin: float = 0.01,
) -> list[PoleSet]:
    """Stable poles in and near the band for every order of the right matrix-fraction model ``H =
    B(z) A(z)^-1``.

    Parameters
    ----------
    frequency : (lines,) Hz, increasing. H : (lines, outputs, inputs).
    orders : increasing polynomial orders (each gives ``order * inputs / 2`` poles at most in the
    band).
    weights : (lines, outputs), one over the standard deviation; default one over the r.m.s. of each
    output.
    margin : fraction of the half circle left free at each end of the band, which keeps band edges
    off the real axis of z.

    Raises
    ------
    RecordingError
        When there are fewer lines than coefficients, or H is not finite.
    """
    lines, _, inputs = H.shape
    top = int(orders[-1])
    if not np.all(np.isfinite(H)):
        raise RecordingError(
            "the FRFs hold NaN or infinite entries; drop those lines before identification"
        )
    if 2 * lines < (top + 1) * (inputs + 1):
        raise RecordingError(
            f"{lines} lines cannot carry order {top} with {inputs} references; "
            "lower the order, widen the band, or record with a finer resolution"
        )
    weights = _even_weights(H) if weights is None else weights
    span = frequency[-1] - frequency[0]
    step = (1.0 - 2.0 * margin) / (2.0 * span)
    origin = frequency[0] - margin / (2.0 * step)
    angle = -2.0 * np.pi * (frequency - origin) * step
    T, Q, inputs = reduced_normal_matrices(angle, H, weights, top)
    found: list[PoleSet] = []
    removed = np.zeros_like(T)
    used = 0
    for order in orders:
        size = int(order) + 1
        rows = Q[:, used:size].reshape(-1, Q.shape[2])
        removed = removed + rows.T @ rows
        used = size
        count = size * inputs
        values, vectors = _poles_of((T - removed)[:count, :count], int(order), inputs)
        poles = _in_time(values, step, origin)
        keep = np.isfinite(poles) & (poles.real < 0.0) & (poles.imag > 2.0 * np.pi * origin)
        rank = np.argsort(poles[keep].imag)
        found.append(PoleSet(int(order), poles[keep][rank], vectors[:, keep].T[rank]))
    return found
