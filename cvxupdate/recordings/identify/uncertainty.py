"""Standard deviations of frequency, damping and shape from the covariance of the modal fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.model import Roots, frequency_damping_gradient
from cvxupdate.recordings.identify.refine import normal_matrices
from cvxupdate.recordings.types import Complex, Real

KNOWN = 5.0  # deviations from zero of an entry by which a shape is told


@dataclass(frozen=True)
class Deviations:
    """``frequency`` (modes,) Hz; ``damping`` (modes,); ``shape_real``, ``shape_imag`` (modes,
    outputs) of the shapes whose largest entry is 1, as far as they are told by that (0 there), or
    by the best known where that is not known; ``covariance`` (modes, 2, 2) of frequency and damping
    of each mode."""

    frequency: Real
    damping: Real
    shape_real: Real
    shape_imag: Real
    covariance: Real


def reduced_chi_square(s: Setting, fit: LinearFit, parameters: int) -> float:
    """Weighted misfit per degree of freedom: 1 when the weights are right and the model is
    complete."""
    return fit.cost / max(2 * s.H.size - parameters, 1)


def noise_level(s: Setting, fit: LinearFit) -> float:
    """Weighted misfit per real number that is noise: from its second differences along the lines,
    in which a smooth misfit cancels.

    The median over the lines passes over peaks. 1 for independent lines and right weights; less
    where a window correlates the lines.
    """
    r = s.weights * fit.misfit
    if r.shape[0] < 5:
        return fit.cost / max(2 * s.H.size, 1)
    d = np.mean(np.abs(r[:-2] - 2.0 * r[1:-1] + r[2:]) ** 2, axis=(1, 2)) / 12.0
    return float(np.median(d))


def line_correlation(s: Setting, fit: LinearFit) -> float:
    """How many lines carry one independent piece of noise: ``1 + 2 sum rho_k`` of the weighted
    misfit along the frequency.

    A Hann window or the local polynomial method correlates neighbouring lines, and a model error is
    smooth: either way the lines say less than their number. Summed up to the first lag that is not
    significant (three deviations).
    """
    r = s.weights * fit.misfit
    power = float(np.sum(np.abs(r) ** 2))
    if power == 0.0:
        return 1.0
    lines = r.shape[0]
    spectrum = np.fft.fft(r.reshape(lines, -1), 2 * lines, axis=0)
    products = np.real(np.fft.ifft(np.sum(np.abs(spectrum) ** 2, axis=1)))[1 : lines // 4] / power
    size = 2.0 * r.size * (1.0 - np.arange(1, lines // 4) / lines)
    small = np.flatnonzero(products < 3.0 / np.sqrt(size))
    return 1.0 + 2.0 * float(np.sum(products[: small[0] if small.size else products.size]))


def _rotation(z: Complex) -> Real:
    """Multiplication by a complex number as a real 2 x 2 matrix, (..., 2, 2)."""
    return np.asarray(
        np.stack([np.stack([z.real, -z.imag], -1), np.stack([z.imag, z.real], -1)], -2)
    )


def _held(shape: Complex, covariance: Real) -> int:
    """The entry of a shape that the others are told by: the largest, unless that is hardly known;
    then the best known one, for by an entry that is noise nothing is told."""
    known = np.abs(shape) / np.sqrt(np.maximum(np.trace(covariance, axis1=1, axis2=2), 1e-300))
    top = int(np.argmax(np.abs(shape)))
    return top if known[top] >= KNOWN else int(np.argmax(known))


def deviations(
    s: Setting, roots: Roots, fit: LinearFit, free: NDArray[np.bool_], factor: float
) -> Deviations:
    """Standard deviations, linearised at the estimate; the covariance is multiplied by ``factor``.

    ``weights`` of the setting are one over the standard deviation of a real or imaginary part.
    """
    modes = roots.value.size
    normal = normal_matrices(s, roots, fit, free)
    C = np.linalg.pinv(normal.matrix, rcond=1e-15, hermitian=True) * factor
    pair = np.arange(modes)[:, None] + np.array([0, modes])
    own = C[pair[:, :, None], pair[:, None, :]]
    gradient = frequency_damping_gradient(roots.value, roots.damping)
    covariance = gradient @ own @ gradient.transpose(0, 2, 1)
    std = np.sqrt(np.maximum(np.einsum("mii->mi", covariance), 0.0))
    shape = np.zeros((modes, s.H.shape[1], 2))
    for r in range(modes):
        P = normal.coupling[:, pair[r]]
        block = normal.linear_inverse[:, pair[r][:, None], pair[r]] * factor
        full = block + P @ C @ P.transpose(0, 2, 1)
        top = int(np.argmax(np.abs(fit.shapes[r])))
        held = _held(fit.shapes[r], full)
        cross = P @ C @ P[held].T
        a = _rotation(np.full(P.shape[0], 1.0 / fit.shapes[r, top]))
        b = _rotation(-fit.shapes[r] / (fit.shapes[r, top] * fit.shapes[r, held]))
        aT, bT = a.transpose(0, 2, 1), b.transpose(0, 2, 1)
        mixed = a @ cross @ bT
        result = a @ full @ aT + b @ full[held] @ bT + mixed + mixed.transpose(0, 2, 1)
        result[held] = 0.0
        shape[r] = np.sqrt(np.maximum(np.einsum("oii->oi", result), 0.0))
    return Deviations(std[:, 0], std[:, 1], shape[:, :, 0], shape[:, :, 1], covariance)
