"""Least-squares frequency domain (LSFD): shapes and residuals by linear least squares, given poles
and participations.

Source: P. Guillaume et al., IMAC XXI (2003); Ewins, *Modal Testing* (2000), section 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.identify.model import Roots, linear_basis, real_imag
from cvxupdate.recordings.types import Complex, Real

_ROWS = 2048


@dataclass(frozen=True)
class Setting:
    """The data of a fit.

    ``frequency`` (lines,) Hz above 0; ``H`` and ``weights`` (one over the standard deviation of a
    real or an imaginary part) (lines, outputs, inputs); ``order`` 0, 1, 2 for receptance, mobility,
    accelerance; ``residuals`` the number of (lower, upper) terms.
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

    ``shapes`` (modes, outputs); ``lower``, ``upper`` (terms, outputs, inputs); ``misfit`` (lines,
    outputs, inputs) measured minus fitted; ``cost`` the weighted sum of squares over real and
    imaginary parts; ``gain`` (modes,) the increase of the cost were the mode left out (Wald).
    """

    shapes: Complex
    lower: Real
    upper: Real
    misfit: Complex
    cost: float
    gain: Real


def weights_of(s: Setting, output: int) -> Real:
    """Weights of one output in the order of `real_imag`, (2 lines inputs,)."""
    w = s.weights[:, output].reshape(-1)
    return np.concatenate([w, w])


def gram(D: Real, w: Real) -> Real:
    """``D^T diag(w²) D`` in runs of rows that stay in the cache, (columns, columns)."""
    total = np.zeros((D.shape[1], D.shape[1]))
    for at in range(0, D.shape[0], _ROWS):
        part = w[at : at + _ROWS, None] * D[at : at + _ROWS]
        total += part.T @ part
    return total


def inverse_of(G: Real) -> Real:
    """Inverse of a Gram matrix, scaled to a unit diagonal on the way; columns of zeros give
    zeros."""
    scale = np.sqrt(np.diag(G))
    scale = np.where(scale > 0.0, scale, 1.0)
    outer = scale[:, None] * scale
    return np.asarray(np.linalg.inv(G / outer + 1e-15 * np.eye(scale.size)) / outer)


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
    for o in range(outputs):
        w, h = weights_of(s, o), target[:, o]
        squared = w**2
        inverse = inverse_of(gram(basis, w))
        x[o] = inverse @ (basis.T @ (squared * h))
        # one step of refinement gives back the digits that the normal equations lose
        x[o] += inverse @ (basis.T @ (squared * (h - basis @ x[o])))
        if modes:
            own = inverse[pair[:, :, None], pair[:, None, :]]
            ab = x[o, pair]
            gain += np.einsum("mi,mi->m", ab, np.linalg.solve(own, ab[..., None])[..., 0])
    rest = (target - basis @ x.T).reshape(2, lines, inputs, outputs).transpose(0, 1, 3, 2)
    misfit = np.asarray(rest[0] + 1j * rest[1])
    residual = x[:, 2 * modes :].reshape(outputs, -1, inputs).transpose(1, 0, 2)
    upper = s.residuals[1]
    return LinearFit(
        shapes=(x[:, :modes] + 1j * x[:, modes : 2 * modes]).T.copy(),
        lower=residual[upper:],
        upper=residual[:upper],
        misfit=misfit,
        cost=float(np.sum(np.abs(s.weights * misfit) ** 2)),
        gain=gain,
    )
