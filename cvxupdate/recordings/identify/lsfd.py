"""Least-squares frequency domain (LSFD): shapes and residuals by linear least squares, given poles and participations.

Source: P. Guillaume et al., IMAC XXI (2003); Ewins, *Modal Testing* (2000), section 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.identify.model import Roots, linear_basis, real_imag
from cvxupdate.recordings.types import Complex, Real


@dataclass(frozen=True)
class LinearFit:
    """Shapes and residuals of every output for given roots.

    ``shapes`` (modes, outputs); ``lower``, ``upper`` (outputs, inputs), zero where not fitted; ``misfit`` (lines,
    outputs, inputs) measured minus fitted; ``cost`` the weighted sum of squares over real and imaginary parts;
    ``gain`` (modes,) the increase of the cost were the mode left out (Wald).
    """

    shapes: Complex
    lower: Real
    upper: Real
    misfit: Complex
    cost: float
    gain: Real


def solve_scaled(A: Real, b: Real) -> tuple[Real, Real]:
    """Least squares by normal equations of unit columns: the solution and ``(A^T A)^-1``, rank-safe."""
    scale = np.linalg.norm(A, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    gram = (A.T @ A) / np.outer(scale, scale)
    inverse = np.linalg.pinv(gram, rcond=1e-13, hermitian=True) / np.outer(scale, scale)
    x = inverse @ (A.T @ b)
    # one step of refinement gives back the digits that the normal equations lose
    return x + inverse @ (A.T @ (b - A @ x)), inverse


def lsfd(
    frequency: Real, H: Complex, weights: Real, roots: Roots, *, order: int, residuals: tuple[bool, bool] = (True, True)
) -> LinearFit:
    """Shapes with lower and upper residuals.

    ``frequency`` (lines,) Hz above 0; ``H`` and ``weights`` (one over the standard deviation of a real or an
    imaginary part) (lines, outputs, inputs); ``order`` 0, 1, 2 for receptance, mobility, accelerance; ``residuals``
    (lower, upper).
    """
    _, outputs, inputs = H.shape
    modes = roots.value.size
    basis = linear_basis(frequency, roots, order, residuals)
    shapes = np.empty((modes, outputs), dtype=np.complex128)
    residual = np.zeros((2, outputs, inputs))
    misfit = np.empty_like(H)
    gain = np.zeros(modes)
    cost = 0.0
    pair = np.arange(modes)[:, None] + np.array([0, modes])
    for o in range(outputs):
        w = weights[:, o]
        A = real_imag(w[:, :, None] * basis)
        x, inverse = solve_scaled(A, real_imag((w * H[:, o])[:, :, None])[:, 0])
        shapes[:, o] = x[:modes] + 1j * x[modes : 2 * modes]
        at = 2 * modes
        for k in (1, 0):
            if residuals[k]:
                residual[k, o] = x[at : at + inputs]
                at += inputs
        misfit[:, o] = H[:, o] - basis @ x
        cost += float(np.sum(np.abs(w * misfit[:, o]) ** 2))
        if modes:
            own = inverse[pair[:, :, None], pair[:, None, :]]
            ab = x[pair]
            gain += np.einsum("mi,mi->m", ab, np.einsum("mij,mj->mi", np.linalg.pinv(own, hermitian=True), ab))
    return LinearFit(shapes, residual[0], residual[1], misfit, cost, gain)
