"""Shapes against the mass matrix, and against one another without one (section 2.2.5).

Shapes are (N, modes), real or complex; M is (N, N), sparse or dense, in kg: the full one, or one
reduced to the measured DOFs (``Transformation.reduce``). For complex shapes ᵀ is read as ᴴ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.correlate._shapes import Real, Shapes, as_columns, same_dofs
from cvxupdate.errors import InputError, ModelError


@dataclass(frozen=True)
class ImprovedMass:
    """M_I = M + Vᴴ core V (2.10) as a product, never as a dense N × N matrix; ``V`` is (modes, N),
    ``core`` (modes, modes)."""

    M: Any
    V: Shapes
    core: Shapes

    def __matmul__(self, phi: Shapes) -> Shapes:
        """M_I φ, (N, modes), in kg times the unit of φ."""
        return np.asarray(self.M @ phi + self.V.conj().T @ (self.core @ (self.V @ phi)))

    @property
    def shape(self) -> tuple[int, int]:
        """(N, N)."""
        return (int(self.M.shape[0]), int(self.M.shape[1]))


@dataclass(frozen=True)
class PseudoOrthogonality:
    """The four checks of (2.9), each (measured modes, model modes).

    ``raw`` and ``raw_improved`` (ε₁, ε₂) are of the vectors as given, ``normalised`` and
    ``normalised_improved`` (ε₃, ε₄) of vectors of unit modal mass; ε₁ and ε₃ use the model's mass
    and lean to the model, ε₂ and ε₄ use the mass improved by the measured vectors and lean to the
    measurement.
    """

    raw: Shapes
    raw_improved: Shapes
    normalised: Shapes
    normalised_improved: Shapes


def mass_normalised(phi: Shapes, M: Any) -> Shapes:
    """Columns scaled to unit modal mass, φᴴ M φ = 1 kg. Raises `ModelError` when a shape carries no
    mass."""
    columns = _against(phi, M, "phi")
    mass = np.real(np.sum(columns.conj() * (M @ columns), axis=0))
    if np.any(mass <= 0.0):
        bad = (np.flatnonzero(mass <= 0.0) + 1).tolist()
        raise ModelError(
            f"modal mass of shapes {bad} is not positive; the mass matrix is indefinite or "
            "they do not move"
        )
    return np.asarray(columns / np.sqrt(mass))


def mass_orthogonality(phi_x: Shapes, M: Any, normalise: bool = True) -> Shapes:
    """ε = Φ_Xᴴ M Φ_X (2.7), (modes, modes); I for a perfect test. Chu & DeBroy: off-diagonals below
    0.1.

    ``normalise`` brings each shape to unit modal mass first, since a measured scale is often
    arbitrary. Raises `InputError` when shapes and matrix do not fit.
    """
    phi = mass_normalised(phi_x, M) if normalise else _against(phi_x, M, "phi_x")
    return np.asarray(phi.conj().T @ (M @ phi))


def cross_orthogonality(phi_a: Shapes, M: Any, phi_x: Shapes, normalise: bool = True) -> Shapes:
    """ε = Φ_Aᴴ M Φ_X (2.8), (modes_a, modes_x); its modulus squared is a MAC weighted by mass. As
    `mass_orthogonality`."""
    a, x = _against(phi_a, M, "phi_a"), _against(phi_x, M, "phi_x")
    if normalise:
        a, x = mass_normalised(a, M), mass_normalised(x, M)
    return np.asarray(a.conj().T @ (M @ x))


def improved_mass(M: Any, phi_x: Shapes) -> ImprovedMass:
    """The mass that makes the measured shapes exactly orthonormal, by the smallest weighted change
    (2.10; Berman 1979).

    M_I = M + Vᴴ(I − E)V, V = E⁻¹Φ_XᴴM, E = Φ_XᴴMΦ_X, with Φ_X of unit modal mass, so that
    Φ_XᴴM_IΦ_X = I. Raises `ModelError` when the measured shapes are not independent with respect to
    M.
    """
    phi = mass_normalised(phi_x, M)
    E = phi.conj().T @ (M @ phi)
    if np.linalg.cond(E) > 1e12:
        raise ModelError(
            "improved mass: the measured shapes are not independent; pass each mode once"
        )
    V = np.linalg.solve(E, (M @ phi).conj().T)
    return ImprovedMass(M, V, np.eye(E.shape[0]) - E)


def pseudo_orthogonality(phi_a: Shapes, phi_x: Shapes, M: Any) -> PseudoOrthogonality:
    """The four pseudo-orthogonality checks (2.9), at the measured DOFs or, with expanded shapes, at
    all of them.

    Parameters
    ----------
    phi_a : (N, modes_a). phi_x : (N, modes_x). M : (N, N). Raises as `mass_orthogonality` and
    `improved_mass`.
    """
    a, x = _against(phi_a, M, "phi_a"), _against(phi_x, M, "phi_x")
    MI = improved_mass(M, x)
    an, xn = mass_normalised(a, M), mass_normalised(x, M)
    return PseudoOrthogonality(
        x.conj().T @ (M @ a), x.conj().T @ (MI @ a), xn.conj().T @ (M @ an), xn.conj().T @ (MI @ an)
    )


def reduced_pseudo_orthogonality(phi_a: Shapes, phi_x: Shapes) -> Shapes:
    """O'Callahan's (1995) check in the space of the sensors, without any mass matrix: Φ_An⁺ Φ_Xn,
    (modes_a, modes_x).

    With mass-normalised model shapes Φ_A and SEREP T = Φ_A Φ_An⁺ the full check of expanded shapes
    is Φ_Aᵀ M (T Φ_Xn) = (Φ_Aᵀ M Φ_A) Φ_An⁺ Φ_Xn = Φ_An⁺ Φ_Xn: it equals the full one exactly.

    Parameters
    ----------
    phi_a : (n, modes_a) mass-normalised model shapes at the sensors, modes_a ≤ n. phi_x : (n,
    modes_x) measured shapes,
    NaN where not measured (a least-squares fit over the channels each mode has).

    Raises
    ------
    InputError
        The DOFs differ or a mode has fewer channels than there are model modes. ModelError: the
        channels cannot distinguish
        the model's modes.
    """
    a, x = same_dofs(phi_a, phi_x)
    out = np.empty((a.shape[1], x.shape[1]), dtype=np.result_type(a, x))
    for r in range(x.shape[1]):
        seen = ~np.isnan(x[:, r])
        if seen.sum() < a.shape[1]:
            raise InputError(
                f"reduced pseudo-orthogonality: measured mode {r + 1} has {seen.sum()} "
                f"channels for {a.shape[1]} model modes; keep fewer model modes"
            )
        length = np.linalg.norm(a[seen], axis=0)
        solution, _, rank, _ = np.linalg.lstsq(
            a[seen] / np.where(length > 0, length, 1.0), x[seen, r], rcond=1e-10
        )
        if rank < a.shape[1] or np.any(length == 0.0):
            raise ModelError(
                "reduced pseudo-orthogonality: the sensors cannot distinguish the model's modes; "
                "keep fewer"
            )
        out[:, r] = solution / length
    return out


def off_diagonal(matrix: Shapes) -> float:
    """Largest modulus off the diagonal, the number that goals of orthogonality are stated in; 0 for
    one mode."""
    rest = np.abs(np.asarray(matrix))
    own = np.arange(rest.shape[0])[:, None] == np.arange(rest.shape[1])[None, :]
    return float(np.max(np.where(own, 0.0, rest), initial=0.0))


def weighted_mac(phi_a: Shapes, phi_x: Shapes, M: Any) -> Real:
    """|cross orthogonality|² of unit-mass shapes: a MAC that weighs every DOF by its mass,
    (modes_a, modes_x)."""
    return np.asarray(np.abs(cross_orthogonality(phi_a, M, phi_x)) ** 2)


def _against(phi: Shapes, M: Any, name: str) -> Shapes:
    columns = as_columns(phi, name)
    if M.shape != (columns.shape[0], columns.shape[0]):
        raise InputError(
            f"{name} has {columns.shape[0]} DOFs but the mass matrix is {M.shape}; reduce M "
            "to the measured DOFs or expand the shapes"
        )
    if np.any(np.isnan(columns)):
        raise InputError(
            f"{name} has channels that were not measured (NaN); expand the shapes or leave "
            "the channels out"
        )
    return columns
