"""From the measured DOFs to all: the null-space basis of (6.4) to (6.8), and every expansion of
section 2.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import factored, factorise
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.reduction import (
    Transformation,
    dynamic,
    guyan,
    gysin,
    hybrid_tam,
    irs,
    kidder,
    partition,
    petersmann,
    serep,
    serepa,
    tam,
)
from cvxupdate.residual.ceam_modes import AssignedMode, impedance
from cvxupdate.spec.whole import EXPANSIONS

Index = NDArray[np.int64]
# of forces over displacements in (6.8), both made dimensionless: the motion with the least force,
# not the smallest one
FORCE_WEIGHT = 1e6
REFINED = 3
DENSE = 300  # DOFs up to which the null-space basis itself is formed
TERMS, SLAVES = 3, 20
"""Terms of Kidder's series, modes of Petersmann's: enough well below the slaves' resonances."""


def null_space_basis(Z: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Orthonormal basis [V; V̄] (2N, N) of the null space of Γ = [Z I] by QR (6.4, 6.5): Z V + V̄ =
    0."""
    N = len(Z)
    Q, _ = la.qr(np.vstack([np.eye(N, dtype=Z.dtype), -Z]), mode="economic")
    return Q[:N], Q[N:]


def null_space_shape(
    Z: NDArray[Any], at: Index, shape: NDArray[Any], scale: Real
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The full shape φ = V e and the force Z̄ φ = V̄ e of the assigned mode, e = V_n† φ_n (6.8),
    each (N,).

    The pseudo-inverse takes the least ‖φ‖² + ‖Z φ‖²; displacements and forces are brought to one
    unit by ``scale`` (N,), the inverse root of the diagonal of K, and forces weigh ``FORCE_WEIGHT``
    times as much, so that the choice does not depend on the units of the file (in SI units, as the
    thesis has it, newtons outweigh metres by about as much). With all DOFs measured e = V⁻¹ φ.
    """
    scaled = FORCE_WEIGHT * scale[:, None] * Z * scale[None, :]
    V, force = null_space_basis(scaled)
    e = la.lstsq(V[at], shape / scale[at], lapack_driver="gelsy")[0]
    full = scale * (V @ e)
    full[at] = shape
    return full, (force @ e) / scale / FORCE_WEIGHT


def null_space_shape_sparse(
    Z: sp.csc_array, at: Index, shape: NDArray[Any], scale: Real
) -> NDArray[Any]:
    """The full shape of `null_space_shape` (N,) without a dense basis: min ‖φ‖² + ‖Z φ‖² over the
    unmeasured entries in the same scaled coordinates, by its augmented system, whose condition is
    Z's and not its square (Björck 1996, 2.5.3)."""
    N = Z.shape[0]
    rest = np.setdiff1d(np.arange(N), at)
    scaled = sp.csc_array(sp.diags_array(scale) @ Z @ sp.diags_array(scale))
    small = 1.0 / FORCE_WEIGHT
    moving = sp.csc_array(scaled[:, rest])
    kind = np.result_type(scaled.dtype, shape.dtype)
    augmented = sp.csc_array(
        sp.block_array(
            [
                [small * sp.eye_array(N, dtype=kind), moving],
                [moving.conj().T, -small * sp.eye_array(len(rest), dtype=kind)],
            ]
        )
    )
    right = np.concatenate([-(scaled[:, at] @ (shape / scale[at])), np.zeros(len(rest))]).astype(
        kind
    )
    factor = factorise(
        augmented, "the augmented system of the expansion"
    )  # quasi-definite: no pivoting is needed to exist,
    x = factor.solve(right)
    for _ in range(REFINED):  # and refinement makes up for what it costs in accuracy
        x = x + factor.solve(right - augmented @ x)
    full = np.zeros(N, dtype=kind)
    full[at], full[rest] = shape, scale[rest] * x[N:]
    return full


def expand(mode: AssignedMode, m: Matrices, expansion: str, modes: Modes | None) -> NDArray[Any]:
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
        Z = sp.csc_array(impedance(m, mode))
        return (
            null_space_shape(Z.toarray(), mode.at, mode.shape, scale)[0]
            if N <= DENSE
            else null_space_shape_sparse(Z, mode.at, mode.shape, scale)
        )
    if expansion == "dynamic":
        return condensed_shape(sp.csc_array(impedance(m, mode)), mode.at, mode.shape)
    return transformation(expansion, m, mode.at, abs(mode.s) / (2.0 * np.pi), modes).expand(
        mode.shape
    )


def condensed_shape(Z: sp.csc_array, at: Index, shape: NDArray[Any]) -> NDArray[Any]:
    """The motion (N,) under which no force acts on the unmeasured DOFs: φ_s = −Z_ss⁻¹ Z_sn φ_n
    (exact dynamic condensation, 3.17)."""
    N = Z.shape[0]
    rest = np.setdiff1d(np.arange(N), at)
    full = np.zeros(N, dtype=np.result_type(Z.dtype, shape.dtype))
    full[at] = shape
    if len(rest):
        held = factored(
            sp.csc_array(Z[:, rest][rest]),
            "the dynamic stiffness of the structure held at the measured DOFs",
        )
        full[rest] = -held.solve(np.asarray(sp.csr_array(Z)[rest][:, at] @ shape).astype(Z.dtype))
    return full


def transformation(
    expansion: str, m: Matrices, at: Index, frequency: float, modes: Modes | None
) -> Transformation:
    """The expansion matrix of section 2.5 over the masters ``at``, in their order; ``modes`` for
    the modal ones (as many as were measured)."""
    if expansion not in (*BY_MODES, "hybrid"):
        split = partition(m.K, m.M, at)
        ways: dict[str, Callable[[], Transformation]] = {
            "guyan": lambda: guyan(split),
            "irs": lambda: irs(split),
            "dynamic": lambda: dynamic(split, frequency),
            "gysin": lambda: gysin(split, frequency),
            "kidder": lambda: kidder(split, frequency, TERMS),
            "petersmann": lambda: petersmann(split, frequency, min(SLAVES, split.slaves.size)),
        }
        if expansion not in ways:
            raise InputError(
                f"expansion {expansion!r} is not known; choose one of {', '.join(EXPANSIONS)}."
            )
        return ways[expansion]()
    phi = _shapes(modes, len(at))
    if expansion == "hybrid":
        return hybrid_tam(phi, m.M, guyan(partition(m.K, m.M, at)))
    return BY_MODES[expansion](phi, at)


BY_MODES: Mapping[str, Callable[[Real, Index], Transformation]] = {
    "serep": serep,
    "serepa": serepa,
    "tam": tam,
}


def _shapes(modes: Modes | None, most: int) -> Real:
    if modes is None:
        raise InputError(
            "a modal expansion (serep, serepa, tam, hybrid) needs the model's modes; give "
            'them, or take expansion = "dynamic".'
        )
    return modes.shapes[:, : min(most, modes.shapes.shape[1])]
