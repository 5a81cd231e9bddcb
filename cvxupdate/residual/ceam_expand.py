"""From the measured DOFs to all: the null-space basis of (6.4) to (6.8), and every expansion of section 2.5."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.reduction import Transformation, dynamic, guyan, gysin, hybrid_tam, irs, partition, serep, serepa, tam
from cvxupdate.residual.ceam_modes import AssignedMode, impedance

Index = NDArray[np.int64]
FORCE_WEIGHT = 1e6  # of forces over displacements in (6.8), both made dimensionless: the motion with the least force, not the smallest one
EXPANSIONS = ("dynamic", "null-space", "guyan", "irs", "gysin", "serep", "serepa", "tam", "hybrid")


def null_space_basis(Z: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Orthonormal basis [V; V̄] (2N, N) of the null space of Γ = [Z I] by QR (6.4, 6.5): Z V + V̄ = 0."""
    N = len(Z)
    Q, _ = la.qr(np.vstack([np.eye(N, dtype=Z.dtype), -Z]), mode="economic")
    return Q[:N], Q[N:]


def null_space_shape(Z: NDArray[Any], at: Index, shape: NDArray[Any], scale: Real) -> tuple[NDArray[Any], NDArray[Any]]:
    """The full shape φ = V e and the force Z̄ φ = V̄ e of the assigned mode, e = V_n† φ_n (6.8), each (N,).

    The pseudo-inverse takes the least ‖φ‖² + ‖Z φ‖²; displacements and forces are brought to one unit by ``scale`` (N,), the inverse root of
    the diagonal of K, and forces weigh ``FORCE_WEIGHT`` times as much, so that the choice does not depend on the units of the file (in SI units, as
    the thesis has it, newtons outweigh metres by about as much). With all DOFs measured e = V⁻¹ φ.
    """
    scaled = FORCE_WEIGHT * scale[:, None] * Z * scale[None, :]
    V, force = null_space_basis(scaled)
    e = la.lstsq(V[at], shape / scale[at], lapack_driver="gelsy")[0]
    full = scale * (V @ e)
    full[at] = shape
    return full, (force @ e) / scale / FORCE_WEIGHT


def expand(mode: AssignedMode, m: Matrices, expansion: str, modes: Modes | None = None) -> NDArray[Any]:
    """The shape at all N DOFs.

    Raises
    ------
    InputError
        For a name that is none of `EXPANSIONS`, or too few measured DOFs for a modal expansion.
    """
    N = m.K.shape[0]
    if mode.full(N):
        out = np.zeros(N, dtype=mode.shape.dtype)
        out[mode.at] = mode.shape
        return out
    if expansion == "null-space":
        diagonal = m.K.diagonal()
        scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, diagonal.max()))
        return null_space_shape(np.asarray(impedance(m, mode).toarray()), mode.at, mode.shape, scale)[0]
    if expansion == "dynamic":
        return condensed(np.asarray(impedance(m, mode).toarray()), mode.at) @ mode.shape
    return transformation(expansion, m, mode.at, abs(mode.s) / (2.0 * np.pi), modes).expand(mode.shape)


def condensed(Z: NDArray[Any], at: Index) -> NDArray[Any]:
    """T (N, n) with x = T x_n where no force acts on the other DOFs: T_s = −Z_ss⁻¹ Z_sn (exact dynamic condensation, 3.17)."""
    N = len(Z)
    rest = np.setdiff1d(np.arange(N), at)
    T = np.zeros((N, len(at)), dtype=Z.dtype)
    T[at, np.arange(len(at))] = 1.0
    if len(rest):
        T[rest] = -la.solve(Z[np.ix_(rest, rest)], Z[np.ix_(rest, at)])
    return T


def transformation(expansion: str, m: Matrices, at: Index, frequency: float, modes: Modes | None) -> Transformation:
    """The expansion matrix of section 2.5 over the masters ``at``, in their order; ``modes`` for the modal ones (as many as were measured)."""
    if expansion in ("guyan", "irs", "gysin", "hybrid", "dynamic"):
        split = partition(m.K, m.M, at)
        if expansion == "hybrid":
            return hybrid_tam(_shapes(modes, len(at)), m.M, guyan(split))
        if expansion == "dynamic":
            return dynamic(split, frequency)
        return guyan(split) if expansion == "guyan" else irs(split) if expansion == "irs" else gysin(split, frequency)
    if expansion not in ("serep", "serepa", "tam"):
        raise InputError(f"expansion {expansion!r} is not known; choose one of {', '.join(EXPANSIONS)}.")
    phi = _shapes(modes, len(at))
    return serep(phi, at) if expansion == "serep" else serepa(phi, at) if expansion == "serepa" else tam(phi, at)


def _shapes(modes: Modes | None, most: int) -> Real:
    if modes is None:
        raise InputError("a modal expansion (serep, serepa, tam, hybrid) needs the model's modes; give them, or take expansion = \"dynamic\".")
    return modes.shapes[:, : min(most, modes.shapes.shape[1])]


def expand_all(assigned: Sequence[AssignedMode], m: Matrices, expansion: str, modes: Modes | None) -> tuple[NDArray[Any], ...]:
    """Every mode at all DOFs."""
    return tuple(expand(mode, m, expansion, modes) for mode in assigned)
