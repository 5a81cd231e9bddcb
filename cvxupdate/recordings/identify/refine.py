"""Maximum-likelihood refinement of the modal model, and the covariance of its parameters.

Gauss-Newton (Levenberg's damping) over poles and participations, the shapes and residuals of each output eliminated
exactly: variable projection in Kaufman's form (G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1). Each FRF entry
is weighted by its variance, so for circular Gaussian noise the estimate is the maximum-likelihood one and the inverse
of the Gauss-Newton matrix its covariance (P. Guillaume, P. Verboven, S. Vanlanduit, ISMA 23 (1998); Pintelon &
Schoukens (2012), section 9.11).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.convert import differentiator
from cvxupdate.recordings.identify.lsfd import LinearFit, lsfd, solve_scaled
from cvxupdate.recordings.identify.model import Roots, linear_basis, pinned, real_imag, root_columns, terms
from cvxupdate.recordings.types import Complex, Real


@dataclass(frozen=True)
class Setting:
    """The data of a fit: see `lsfd` for the fields."""

    frequency: Real
    H: Complex
    weights: Real
    order: int
    residuals: tuple[bool, bool] = (True, True)


@dataclass(frozen=True)
class Normal:
    """Gauss-Newton matrices with the linear unknowns eliminated.

    ``matrix`` (k, k), ``gradient`` (k,) for the roots and free participations; ``linear_inverse`` (outputs, c, c) is
    ``(A^T A)^-1`` and ``coupling`` (outputs, c, k) is ``(A^T A)^-1 A^T B``.
    """

    matrix: Real
    gradient: Real
    linear_inverse: Real
    coupling: Real


def _fit(s: Setting, roots: Roots) -> LinearFit:
    return lsfd(s.frequency, s.H, s.weights, roots, order=s.order, residuals=s.residuals)


def normal_matrices(s: Setting, roots: Roots, fit: LinearFit, free: NDArray[np.bool_]) -> Normal:
    """`Normal` at the given roots and their linear fit."""
    basis = linear_basis(s.frequency, roots, s.order, s.residuals)
    all_terms = terms(s.frequency, roots.value, roots.damping)
    g = differentiator(s.frequency, s.order)
    k = 2 * roots.value.size + 2 * int(np.count_nonzero(free))
    matrix, gradient = np.zeros((k, k)), np.zeros(k)
    inverses, couplings = [], []
    for o in range(s.H.shape[1]):
        w = s.weights[:, o][:, :, None]
        A = real_imag(w * basis)
        B = real_imag(w * root_columns(all_terms, g, roots, fit.shapes[:, o], np.asarray(free)))
        P, inverse = solve_scaled(A, B)
        B = B - A @ P
        matrix += B.T @ B
        gradient += B.T @ real_imag(w * fit.misfit[:, o][:, :, None])[:, 0]
        inverses.append(inverse)
        couplings.append(P)
    return Normal(matrix, gradient, np.array(inverses), np.array(couplings))


def _moved(roots: Roots, free: NDArray[np.bool_], delta: Real) -> Roots:
    modes = roots.value.size
    count = int(np.count_nonzero(free))
    participation = roots.participation.copy()
    participation[free] += delta[2 * modes : 2 * modes + count] + 1j * delta[2 * modes + count :]
    return Roots(roots.value + delta[:modes] + 1j * delta[modes : 2 * modes], participation, roots.damping)


def _stable(roots: Roots) -> bool:
    a, b = roots.value.real, roots.value.imag
    damped = a < 0.0 if roots.damping == "viscous" else (a > 0.0) & (b > 0.0)
    return bool(np.all(damped & np.isfinite(roots.value)))


def refine(s: Setting, start: Roots, *, iterations: int = 20, tolerance: float = 1e-7) -> tuple[Roots, LinearFit]:
    """Roots and linear fit of least weighted cost near ``start``; ``iterations = 0`` leaves the roots as they are.

    A step that does not lower the cost, or makes a mode unstable, is shortened; the search ends when a full step
    lowers the cost by less than ``tolerance`` times itself.
    """
    scaled, free_mask = pinned(start.participation)
    free = np.asarray(free_mask, dtype=bool)
    roots = Roots(start.value, scaled, start.damping)
    fit = _fit(s, roots)
    damping = 1e-4
    for _ in range(iterations if roots.value.size else 0):
        normal = normal_matrices(s, roots, fit, free)
        diagonal = np.diag(normal.matrix)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scaled_matrix = scale[:, None] * normal.matrix * scale
        gained = -1.0
        for _ in range(8):
            delta = scale * np.linalg.solve(scaled_matrix + damping * np.eye(scale.size), scale * normal.gradient)
            trial = _moved(roots, free, delta)
            if _stable(trial):
                trial_fit = _fit(s, trial)
                gained = fit.cost - trial_fit.cost
                if gained >= 0.0:
                    break
            damping = max(10.0 * damping, 1e-3)
        if gained < 0.0:
            break
        roots, fit = trial, trial_fit
        damping = max(damping / 10.0, 1e-9)
        if gained <= tolerance * fit.cost:
            break
    return roots, fit
