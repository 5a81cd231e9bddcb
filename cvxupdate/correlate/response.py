"""Frequency responses of a model at many lines: Galerkin on its modes and static corrections, with
all its damping."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.errors import InputError
from cvxupdate.fe.factor import factorise
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

WHOLE = 150
"""DOFs up to which the basis is the whole model, so that nothing is truncated."""
BEYOND = 2.0
"""Modes are taken up to this many times the highest line; static corrections stand for the rest."""
POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
CHUNK = 4_000_000
"""Entries of reduced matrices held at a time."""


def model_frf(
    model: Model,
    frequency: Real,
    responses: Index,
    references: Index,
    quantity: str = "displacement",
    p: Real | None = None,
) -> Complex:
    """H (lines, responses, references) per unit force, at ``frequency`` (lines,) Hz; DOFs are
    places among the free ones, −1 held (H = 0).

    M q'' + C q' + (K + iD) q = f projected on the modes up to twice the band and on the static
    answer to a unit force at every reference and response (Craig's residual attachment modes): a
    mode beyond contributes its flexibility, error of order (f/2f_max)⁴. Damping need not be
    proportional. Modal damping (`Model.modal_damping`) adds C = Σ 2ζω(Mφ)(Mφ)ᵀ, the last ζ counting
    for the rest.

    Raises
    ------
    InputError
        For a quantity that is no motion. ModelError: the model is a mechanism.
    """
    if quantity not in POWERS:
        raise InputError(f"model_frf: {quantity!r} is no motion; use one of {', '.join(POWERS)}")
    f = np.asarray(frequency, dtype=np.float64)
    m = model.matrices(p)
    modes = model_modes(model, _count(model, float(f.max(initial=1.0)), p), p, m)
    seen_o, seen_i = responses >= 0, references >= 0
    wanted = np.unique(np.concatenate([responses[seen_o], references[seen_i]]))
    U = np.eye(model.size) if model.size <= WHOLE else _basis(m.K, m.M, modes, wanted)
    K, M, D = (_project(U, A) for A in (m.K, m.M, m.D))
    C = _project(U, m.C)
    if model.modal_damping:
        flexible = modes.flexible()
        zeta = np.array(
            [
                model.modal_damping[min(k, len(model.modal_damping) - 1)]
                for k in range(len(flexible.eigenvalues))
            ]
        )
        V = (U.T @ (m.M @ flexible.shapes)) * np.sqrt(
            2.0 * zeta * np.sqrt(np.maximum(flexible.eigenvalues, 0.0))
        )
        C = C + V @ V.T
    load, out = U[references[seen_i]].T, U[responses[seen_o]]
    found = np.zeros((len(f), int(seen_o.sum()), int(seen_i.sum())), dtype=np.complex128)
    step = max(1, CHUNK // max(len(K) ** 2, 1))
    for start in range(0, len(f), step):
        w = 2.0 * np.pi * f[start : start + step, None, None]
        found[start : start + step] = out @ np.linalg.solve(
            K + 1j * D + 1j * w * C - w**2 * M, load.astype(np.complex128)[None]
        )
    H = np.zeros((len(f), len(responses), len(references)), dtype=np.complex128)
    H[np.ix_(np.arange(len(f)), np.flatnonzero(seen_o), np.flatnonzero(seen_i))] = found
    return np.asarray(H * ((2j * np.pi * f) ** POWERS[quantity])[:, None, None])


def _count(model: Model, top: float, p: Real | None) -> int:
    """How many flexible modes reach twice the band: all of a small model, else by doubling."""
    if model.size <= WHOLE:
        return model.size
    count = 30
    while count < model.size:
        modes = model_modes(model, count, p)
        if modes.frequencies[-1] > BEYOND * top or len(modes.eigenvalues) - modes.rigid < count:
            break
        count *= 2
    return min(count, model.size)


def _basis(K: sp.csc_array, M: sp.csc_array, modes: Modes, wanted: Index) -> Real:
    """Modes and static corrections, M-orthonormal; for a free structure the corrections are taken
    with a shift below its lowest frequency."""
    flexible = modes.flexible().eigenvalues
    shift = 0.05 * float(flexible[0]) if modes.rigid and len(flexible) else 0.0
    unit = np.zeros((K.shape[0], len(wanted)))
    unit[wanted, np.arange(len(wanted))] = 1.0
    static = factorise(sp.csc_array(K + shift * M), "the stiffness").solve(unit)
    static = static - modes.shapes @ (modes.shapes.T @ (M @ static))
    U, kept, _ = np.linalg.svd(
        static / np.maximum(np.linalg.norm(static, axis=0), np.finfo(float).tiny),
        full_matrices=False,
    )
    return np.hstack([modes.shapes, U[:, kept > 1e-8 * kept[0]]])


def _project(U: Real, A: sp.csc_array) -> Real:
    B = np.asarray(U.T @ (A @ U))
    return (B + B.T) / 2.0  # symmetric to the last digit, so that responses are reciprocal
