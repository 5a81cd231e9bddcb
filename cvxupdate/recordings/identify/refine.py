"""Maximum-likelihood refinement of the modal model, and the covariance of its parameters.

Gauss-Newton (Levenberg's damping) over poles and participations, the shapes and residuals of each
output eliminated exactly: variable projection in Kaufman's form (G. Golub, V. Pereyra, Inverse
Problems 19 (2003) R1). Each FRF entry is weighted by its variance, so for circular Gaussian noise
the estimate is the maximum-likelihood one and the inverse of the Gauss-Newton matrix its covariance
(P. Guillaume, P. Verboven, S. Vanlanduit, ISMA 23 (1998); Pintelon & Schoukens (2012), section
9.11).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.identify.lsfd import (
    LinearFit,
    Setting,
    gram,
    inverse_of,
    lsfd,
    weights_of,
)
from cvxupdate.recordings.identify.model import (
    Roots,
    linear_basis,
    pinned,
    real_imag,
    root_dictionary,
)
from cvxupdate.recordings.types import Real


@dataclass(frozen=True)
class Normal:
    """Gauss-Newton matrices with the linear unknowns eliminated.

    ``matrix`` (k, k), ``gradient`` (k,) for the roots and free participations; ``linear_inverse``
    (outputs, c, c) is ``(A^T A)^-1`` and ``coupling`` (outputs, c, k) is ``(A^T A)^-1 A^T B``.
    """

    matrix: Real
    gradient: Real
    linear_inverse: Real
    coupling: Real


def normal_matrices(s: Setting, roots: Roots, fit: LinearFit, free: NDArray[np.bool_]) -> Normal:
    """`Normal` at the given roots and their linear fit."""
    basis = real_imag(linear_basis(s.frequency, roots, s.order, s.residuals, s.band))
    X, Y, mode = root_dictionary(s.frequency, roots, s.order, free)
    modes, count = roots.value.size, mode.size
    # columns: Re roots, Im roots, Re participations, Im participations
    sort = np.concatenate(
        [
            np.arange(modes),
            count + np.arange(modes),
            np.arange(modes, count),
            count + np.arange(modes, count),
        ]
    )
    every = np.concatenate([basis, X, Y], axis=1)
    split = basis.shape[1]
    matrix, gradient = np.zeros((2 * count, 2 * count)), np.zeros(2 * count)
    inverses, couplings = [], []
    rest = real_imag(fit.misfit.transpose(0, 2, 1))
    for o in range(s.H.shape[1]):
        w = weights_of(s, o)
        G = gram(every, w)
        re, im = np.diag(fit.shapes.real[mode, o]), np.diag(fit.shapes.imag[mode, o])
        # the derivatives are X, Y times the shapes: their products come from those of X, Y
        T = np.block([[re, -im], [im, re]])[:, sort]
        inverse = inverse_of(G[:split, :split])
        AB = G[:split, split:] @ T
        P = inverse @ AB
        P += inverse @ (AB - G[:split, :split] @ P)
        matrix += T.T @ G[split:, split:] @ T - AB.T @ P
        slope = every.T @ (w**2 * rest[:, o])
        gradient += T.T @ slope[split:] - P.T @ slope[:split]
        inverses.append(inverse)
        couplings.append(P)
    matrix = 0.5 * (matrix + matrix.T)
    return Normal(matrix, gradient, np.array(inverses), np.array(couplings))


def _moved(roots: Roots, free: NDArray[np.bool_], delta: Real) -> Roots:
    modes = roots.value.size
    count = int(np.count_nonzero(free))
    participation = roots.participation.copy()
    participation[free] += delta[2 * modes : 2 * modes + count] + 1j * delta[2 * modes + count :]
    return Roots(
        roots.value + delta[:modes] + 1j * delta[modes : 2 * modes], participation, roots.damping
    )


def _stable(roots: Roots) -> bool:
    a, b = roots.value.real, roots.value.imag
    damped = a < 0.0 if roots.damping == "viscous" else (a > 0.0) & (b > 0.0)
    return bool(np.all(damped & np.isfinite(roots.value)))


def refine(
    s: Setting, start: Roots, *, iterations: int = 20, tolerance: float = 1e-7
) -> tuple[Roots, LinearFit]:
    """Roots and linear fit of least weighted cost near ``start``; ``iterations = 0`` leaves the
    roots as they are.

    A step that does not lower the cost, or makes a mode unstable, is shortened; the search ends
    when a full step lowers the cost by less than ``tolerance`` times itself.
    """
    scaled, free = pinned(start.participation)
    roots = Roots(start.value, scaled, start.damping)
    fit = lsfd(s, roots)
    damping = 1e-4
    # nothing is left to gain once the misfit is rounding
    rounding = 1e-20 * float(np.sum(np.abs(s.weights * s.H) ** 2))
    for _ in range(iterations if roots.value.size else 0):
        normal = normal_matrices(s, roots, fit, free)
        diagonal = np.diag(normal.matrix)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scaled_matrix = scale[:, None] * normal.matrix * scale
        gained = -1.0
        for _ in range(8):
            delta = scale * np.linalg.solve(
                scaled_matrix + damping * np.eye(scale.size), scale * normal.gradient
            )
            trial = _moved(roots, free, delta)
            if _stable(trial):
                trial_fit = lsfd(s, trial)
                gained = fit.cost - trial_fit.cost
                if gained >= 0.0:
                    break
            damping = max(10.0 * damping, 1e-3)
        if gained < 0.0:
            break
        roots, fit = trial, trial_fit
        damping = max(damping / 10.0, 1e-9)
        if gained <= tolerance * fit.cost or fit.cost < rounding:
            break
    return roots, fit
