"""Damping to begin with (thesis 3.5.3): Rayleigh from modal damping, the C of modal damping, an
average loss factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import model_modes, natural_modes

LARGEST = 2000
"""Free DOFs above which modal damping's full C is not formed."""


def rayleigh_from_modal(frequency: ArrayLike, zeta: ArrayLike) -> tuple[float, float]:
    """(alpha in 1/s, beta in s) of C = alpha M + beta K that fit ζ_r = (alpha/ω_r + beta ω_r)/2 by
    least squares (3.43; the thesis swaps the letters).

    Neither is taken below zero: where the fit would, the other alone is fitted.

    Raises
    ------
    InputError
        When no mode is given, a frequency is not above zero, or a ζ is negative or not a number.
    """
    w, z = (
        2.0 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float)),
        np.atleast_1d(np.asarray(zeta, dtype=float)),
    )
    if not len(w) or w.shape != z.shape or not np.all(w > 0.0) or not np.all(z >= 0.0):
        raise InputError(
            "damping: give a frequency above 0 and a damping ratio of 0 or more for each mode."
        )
    A = np.column_stack([1.0 / (2.0 * w), w / 2.0])
    size = np.linalg.norm(A, axis=0)
    both = (
        np.linalg.lstsq(A / size, z, rcond=None)[0] / size if len(w) > 1 else np.array([-1.0, 1.0])
    )
    if np.all(both >= 0.0):
        return float(both[0]), float(both[1])
    alone = [max(float(A[:, k] @ z) / float(A[:, k] @ A[:, k]), 0.0) for k in (0, 1)]
    left = [float(np.linalg.norm(A[:, k] * alone[k] - z)) for k in (0, 1)]
    return (alone[0], 0.0) if left[0] < left[1] else (0.0, alone[1])


def loss_factor_from_modal(zeta: ArrayLike) -> float:
    """η = 2 times the mean damping ratio (3.47)."""
    z = np.atleast_1d(np.asarray(zeta, dtype=float))
    if not len(z) or not np.all(z >= 0.0):
        raise InputError("damping: give at least one damping ratio, none below 0.")
    return float(2.0 * np.mean(z))


def modal_matrix(eigenvalues: Real, shapes: Real, M: sp.csc_array, zeta: Real) -> Real:
    """C = Σ 2 ζ ω (M φ)(M φ)ᵀ of mass-normalised modes (3.44 with the M that makes it a damping
    matrix: the thesis leaves it out), (N, N)."""
    U = (M @ shapes) * np.sqrt(2.0 * np.asarray(zeta) * np.sqrt(np.maximum(eigenvalues, 0.0)))
    return np.asarray(U @ U.T)


def with_modal_damping(model: Model, m: Matrices) -> Matrices:
    """``m`` with the C of the model's modal damping on all its flexible modes (the last ζ counts
    for the rest), and D of the share of it that is hysteretic.

    Both are those of the matrices given and are not differentiated: a change of K or M is taken not
    to change them within a step.

    Raises
    ------
    ModelError
        Above 2000 free DOFs.
    """
    if model.size > LARGEST:
        raise ModelError(
            f"modal damping needs every mode of the model's {model.size} DOFs for its "
            "frequency responses. Use structural or Rayleigh damping "
            "(fe.damping.rayleigh_from_modal gives the coefficients) for a model this large."
        )
    drawn = not any(b.kind.name == "matrix" for b in model.blocks)
    modes = (
        model_modes(model, model.size, None, m) if drawn else natural_modes(m.K, m.M, model.size)
    )
    flexible = modes.flexible()
    zeta = np.array(
        [
            model.modal_damping[min(i, len(model.modal_damping) - 1)]
            for i in range(len(flexible.eigenvalues))
        ]
    )
    lam, shapes, share = flexible.eigenvalues, flexible.shapes, model.hysteretic
    C = sp.csc_array(modal_matrix(lam, shapes, m.M, (1.0 - share) * zeta))
    out = replace(m, C=sp.csc_array(m.C + C))
    if not share:
        return out
    omega = np.sqrt(np.maximum(lam, 0.0))  # Σ 2 ζ ω² (M φ)(M φ)ᵀ
    D = sp.csc_array(modal_matrix(lam, shapes, m.M, share * zeta * omega))
    return replace(out, D=sp.csc_array(m.D + D))
