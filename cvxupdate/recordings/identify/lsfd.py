"""Least-squares frequency domain (LSFD): shapes and residuals by linear least squares, given poles and participations.

Source: P. Guillaume et al., IMAC XXI (2003); Ewins, *Modal Testing* (2000), section 4.4.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.identify.model import Roots, linear_basis, real_imag
from cvxupdate.recordings.types import Complex, Real

_BATCH_BYTES = 64_000_000


@dataclass(frozen=True)
class Setting:
    """The data of a fit.

    ``frequency`` (lines,) Hz above 0; ``H`` and ``weights`` (one over the standard deviation of a real or an imaginary part)
    (lines, outputs, inputs); ``order`` 0, 1, 2 for receptance, mobility, accelerance; ``residuals`` the number of (lower,
    upper) terms.
    """

    frequency: Real
    H: Complex
    weights: Real
    order: int
    residuals: tuple[int, int] = (1, 1)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        return float(self.frequency.min()), float(self.frequency.max())


@dataclass(frozen=True)
class LinearFit:
    """Shapes and residuals of every output for given roots.

    ``shapes`` (modes, outputs); ``lower``, ``upper`` (terms, outputs, inputs); ``misfit`` (lines, outputs, inputs) measured
    minus fitted; ``cost`` the weighted sum of squares over real and imaginary parts; ``gain`` (modes,) the increase of the
    cost were the mode left out (Wald).
    """

    shapes: Complex
    lower: Real
    upper: Real
    misfit: Complex
    cost: float
    gain: Real


def batches(s: Setting, columns: int) -> Iterator[slice]:
    """Runs of outputs whose weighted design matrices fit in memory together."""
    several = max(1, _BATCH_BYTES // (16 * s.frequency.size * s.H.shape[2] * max(columns, 1)))
    for start in range(0, s.H.shape[1], several):
        yield slice(start, min(start + several, s.H.shape[1]))


def weight_rows(s: Setting, part: slice) -> Real:
    """Weights of some outputs in the order of `real_imag`, (outputs, 2 lines inputs, 1)."""
    w = s.weights[:, part].transpose(1, 0, 2).reshape(part.stop - part.start, -1)
    return np.concatenate([w, w], axis=1)[:, :, None]


def solve_scaled(A: Real, b: Real) -> tuple[Real, Real]:
    """Least squares by normal equations of unit columns, stacked: x (..., c, k) and ``(A^T A)^-1`` (..., c, c)."""
    scale = np.linalg.norm(A, axis=-2)
    scale = np.where(scale > 0.0, scale, 1.0)
    At = A.swapaxes(-1, -2)
    outer = scale[..., :, None] * scale[..., None, :]
    gram = (At @ A) / outer
    inverse = np.linalg.inv(gram + 1e-15 * np.eye(gram.shape[-1])) / outer
    return inverse @ (At @ b), inverse


def lsfd(s: Setting, roots: Roots) -> LinearFit:
    """Shapes with lower and upper residuals for the given roots."""
    lines, outputs, inputs = s.H.shape
    modes = roots.value.size
    basis = real_imag(linear_basis(s.frequency, roots, s.order, s.residuals, s.band))
    count = basis.shape[1]
    target = real_imag(s.H.transpose(0, 2, 1))
    x = np.zeros((outputs, count))
    gain = np.zeros(modes)
    pair = np.arange(modes)[:, None] + np.array([0, modes])
    for part in batches(s, count):
        w = weight_rows(s, part)
        A, b = w * basis, w * target.T[part, :, None]
        solution, inverse = solve_scaled(A, b)
        # one step of refinement gives back the digits that the normal equations lose
        solution = solution + inverse @ (A.swapaxes(1, 2) @ (b - A @ solution))
        x[part] = solution[:, :, 0]
        if modes:
            own = inverse[:, pair[:, :, None], pair[:, None, :]]
            ab = x[part][:, pair]
            gain += np.einsum("omi,omi->m", ab, np.linalg.solve(own, ab[..., None])[..., 0])
    rest = (target - basis @ x.T).reshape(2, lines, inputs, outputs).transpose(0, 1, 3, 2)
    misfit = np.asarray(rest[0] + 1j * rest[1])
    residual = x[:, 2 * modes :].reshape(outputs, -1, inputs).transpose(1, 0, 2)
    upper = s.residuals[1]
    return LinearFit(
        shapes=(x[:, :modes] + 1j * x[:, modes : 2 * modes]).T.copy(), lower=residual[upper:], upper=residual[:upper],
        misfit=misfit, cost=float(np.sum(np.abs(s.weights * misfit) ** 2)), gain=gain,
    )
