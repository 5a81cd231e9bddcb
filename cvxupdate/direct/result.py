"""What a direct method gives back, with the faults that such methods are known for (2.7),
measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DirectUpdate:
    """Updated matrices (N, N), dense: ``M`` kg, ``K`` N/m, ``C`` N·s/m, ``D`` N/m (hysteretic; each
    None where the method has no such damping)."""

    method: str
    M: Real
    K: Real
    C: Real | None = None
    D: Real | None = None


@dataclass(frozen=True)
class Faults:
    """What went wrong, each figure measured.

    ``reproduction`` largest ‖M Φ Λ² + C Φ Λ + K Φ‖ / ‖terms‖ of an assigned mode; ``asymmetry`` of
    the worst matrix, relative; ``mass_min``, ``stiffness_min`` smallest eigenvalues of the matrices
    scaled to the unit diagonal of the initial ones; ``new_entries`` entries (above 1e-9 of the
    scaled largest) where the initial model has none; ``rigid`` largest relative force that a
    rigid-body mode of the initial model now meets; ``spurious`` eigenvalues below the highest
    assigned one that neither the model nor the measurement had; ``says`` one sentence each.
    """

    reproduction: float
    asymmetry: float
    mass_min: float
    stiffness_min: float
    new_entries: int
    rigid: float
    spurious: int
    says: tuple[str, ...]


def faults(
    update: DirectUpdate,
    K_A: Any,
    M_A: Any,
    Phi: NDArray[Any],
    eigenvalues: NDArray[Any],
    tolerance: float = 1e-8,
) -> Faults:
    """Check an update against the initial model and the modes that it was to reproduce.

    Parameters
    ----------
    K_A, M_A : (N, N) initial matrices, sparse or dense; Phi : (N, m) assigned shapes.
    eigenvalues : (m,) real λ = ω² (K φ = λ M φ), complex rates s ((s² M + s C + K) φ = 0) when the
    update has C, complex λ ((K + i D) φ = λ M φ) when it has D.
    """
    K0, M0 = _dense(K_A), _dense(M_A)
    matrices = [m for m in (update.M, update.K, update.C, update.D) if m is not None]
    mass_min, stiffness_min = _smallest(update.M, M0), _smallest(update.K, K0)
    values, vectors = (
        la.eigh(K0, M0) if np.all(la.eigvalsh(M0) > 0) else (np.zeros(0), np.zeros((len(K0), 0)))
    )
    spurious = (
        _spurious(update, values, eigenvalues)
        if values.size and not np.iscomplexobj(eigenvalues) and mass_min > 0
        else 0
    )
    found = Faults(
        reproduced(update, Phi, eigenvalues),
        max(
            float(np.abs(m - m.T).max() / max(np.abs(m).max(), np.finfo(float).tiny))
            for m in matrices
        ),
        mass_min,
        stiffness_min,
        _new_entries(update.M, M0) + _new_entries(update.K, K0),
        _rigid_force(update, values, vectors),
        spurious,
        (),
    )
    return replace(found, says=tuple(_sentences(found, tolerance)))


def _sentences(found: Faults, tolerance: float) -> Iterator[str]:
    """One sentence for each fault beyond rounding."""
    if found.reproduction > tolerance:
        yield (
            "an assigned mode is not reproduced: its equation of motion fails by "
            f"{found.reproduction:.1e}"
        )
    if found.asymmetry > 1e-9:
        yield f"a matrix is not symmetric (by {found.asymmetry:.1e}): reciprocity is lost"
    for name, least, bound in (
        ("mass", found.mass_min, 0.0),
        ("stiffness", found.stiffness_min, -1e-10),
    ):
        if least < bound or (name == "mass" and least == bound):
            yield (
                f"the {name} matrix has lost its definiteness: smallest scaled eigenvalue "
                f"{least:.1e}"
            )
    if found.new_entries:
        yield (
            f"{found.new_entries} entries appear where the model has no element: the "
            "connectivity is lost"
        )
    if found.rigid > 1e-9:
        yield f"a rigid-body motion now meets a force ({found.rigid:.1e} of the stiffness)"
    if found.spurious:
        yield (
            f"{found.spurious} mode(s) below the highest assigned one belong neither to the model "
            "nor to the measurement"
        )


def _rigid_force(update: DirectUpdate, values: Real, vectors: Real) -> float:
    """Largest relative force that a rigid-body mode of the initial model meets."""
    if not values.size:
        return 0.0
    modes = vectors[:, np.abs(values) < 1e-8 * np.abs(values).max(initial=1.0)]
    if not modes.shape[1]:
        return 0.0
    return float(
        np.linalg.norm(update.K @ modes, axis=0).max()
        / (np.linalg.norm(update.K, 2) * np.linalg.norm(modes, axis=0).min())
    )


def reproduced(update: DirectUpdate, Phi: NDArray[Any], eigenvalues: NDArray[Any]) -> float:
    """Largest relative force residual of the assigned modes; see `faults`."""
    if update.C is None:
        stiff = update.K @ Phi
        if update.D is not None:
            stiff = stiff + 1j * (update.D @ Phi)
        terms = [-(update.M @ Phi) * eigenvalues[None, :], stiff]
    else:
        terms = [
            (update.M @ Phi) * eigenvalues[None, :] ** 2,
            (update.C @ Phi) * eigenvalues[None, :],
            update.K @ Phi,
        ]
    force = np.linalg.norm(np.sum(terms, axis=0), axis=0)
    # For a shape of low frequency K φ is small beside |K| |φ|: rounding is counted against what is
    # summed, as in any product.
    size = np.linalg.norm(np.abs(update.K) @ np.abs(Phi), axis=0)
    return float((force / np.where(size > 0, size, 1.0)).max())


def change_by_dof(update: DirectUpdate, K_A: Any, M_A: Any) -> Real:
    """The part (N,) of the squared change of K, M and D, each scaled to the unit diagonal of the
    initial one, that stands in the row of each DOF; they add up to 1 (to 0 where nothing changed).
    """
    K0, M0 = _dense(K_A), _dense(M_A)
    part = np.zeros(len(K0))
    for change, first in ((update.K - K0, K0), (update.M - M0, M0), (update.D, K0)):
        if change is not None:
            s = _scale(first)
            part += np.sum((s[:, None] * change * s[None, :]) ** 2, axis=1)
    whole = float(part.sum())
    return part / whole if whole > 0.0 else part


def _dense(A: Any) -> Real:
    return np.asarray(A.toarray() if sp.issparse(A) else A, dtype=float)


def _scale(A0: Real) -> Real:
    d = np.abs(np.diag(A0))
    return np.asarray(1.0 / np.sqrt(np.where(d > 0, d, d.max(initial=1.0))))


def _smallest(A: Real, A0: Real) -> float:
    s = _scale(A0)
    return float(np.linalg.eigvalsh(s[:, None] * 0.5 * (A + A.T) * s[None, :])[0])


def _new_entries(A: Real, A0: Real) -> int:
    s = _scale(A0)
    scaled = np.abs(s[:, None] * A * s[None, :])
    return int(np.sum(np.triu((scaled > 1e-9 * scaled.max()) & (A0 == 0.0))))


def _spurious(update: DirectUpdate, before: Real, assigned: Real) -> int:
    top = float(assigned.max())
    now = la.eigh(0.5 * (update.K + update.K.T), 0.5 * (update.M + update.M.T), eigvals_only=True)
    expected = int(np.sum(before < top * (1 - 1e-9)))
    return max(0, int(np.sum(now < top * (1 - 1e-6))) - max(expected, len(assigned) - 1))
