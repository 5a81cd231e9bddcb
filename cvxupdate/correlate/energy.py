"""Kinetic and potential energy of measured and model shapes in the model's matrices (2.11; Bugeat &
Lallement 1976)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.correlate._shapes import Real, Shapes, same_pairs
from cvxupdate.correlate.elements import ElementBatch, element_energies
from cvxupdate.errors import InputError


@dataclass(frozen=True)
class EnergyComparison:
    """Energies of paired modes, each (modes,): ½φᴴMφ (kinetic, per ω²) and ½φᴴKφ (potential), of
    the model and measured."""

    kinetic_model: Real
    kinetic_measured: Real
    potential_model: Real
    potential_measured: Real

    @property
    def kinetic_difference(self) -> Real:
        """½φ_XᴴMφ_X − ½φ_AᴴMφ_A, (modes,). The print of (2.11) names it ε_P and the other ε_K: the
        names are swapped."""
        return self.kinetic_measured - self.kinetic_model

    @property
    def potential_difference(self) -> Real:
        """½φ_XᴴKφ_X − ½φ_AᴴKφ_A, (modes,)."""
        return self.potential_measured - self.potential_model

    @property
    def rayleigh_frequency(self) -> Real:
        """√(φ_XᴴKφ_X / φ_XᴴMφ_X)/2π in Hz: the frequency that the model gives to each measured
        shape, whatever its scale."""
        return np.asarray(np.sqrt(self.potential_measured / self.kinetic_measured) / (2.0 * np.pi))


def energy_comparison(K: Any, M: Any, phi_a: Shapes, phi_x: Shapes) -> EnergyComparison:
    """Energies of each pair of modes, in the scale the shapes are given in (bring them to one:
    modal scale factor).

    Parameters
    ----------
    K, M : (N, N), sparse or dense. phi_a, phi_x : (N, modes) paired, the measured ones expanded
    where incomplete.
    Raises `InputError` when shapes do not agree or have gaps.
    """
    a, x = same_pairs(phi_a, phi_x)
    _complete(a, x, "energy_comparison")
    return EnergyComparison(
        *(0.5 * np.real(np.sum(v.conj() * (A @ v), axis=0)) for A in (M, K) for v in (a, x))
    )


def element_energy_fractions(
    batches: Sequence[ElementBatch], phi: Shapes, matrix: str = "K"
) -> Real:
    """Each element's fraction of a mode's energy, (elements, modes); every column sums to 1, so the
    scale of φ is gone."""
    energy = element_energies(batches, phi, matrix)
    total = np.sum(energy, axis=0)
    if np.any(total <= 0.0):
        raise InputError(
            "element energies: a mode has no energy of this kind (a rigid-body mode?); leave it out"
        )
    return np.asarray(energy / total)


def energy_map(
    batches: Sequence[ElementBatch],
    phi_a: Shapes,
    phi_x: Shapes,
    matrix: str = "K",
    floor: float = 0.01,
) -> Real:
    """Where the measured shapes store their energy elsewhere than the model's: 0 (the same) to 1,
    (elements,).

    Σ_r |p_X − p_A| / Σ_r (p_X + p_A) with the fractions p of `element_energy_fractions`, summed
    over the paired modes. In an element that is really softer the measured deformation, and so its
    energy in the model's matrix, is larger. An element with less than ``floor`` of the mean
    fraction cannot be judged; the floor keeps it from being blown up.

    Parameters
    ----------
    phi_a, phi_x : (N, modes) paired, the measured ones expanded where incomplete. Raises
    `InputError` as above.
    """
    a, x = same_pairs(phi_a, phi_x)
    _complete(a, x, "energy_map")
    pa, px = (
        element_energy_fractions(batches, a, matrix),
        element_energy_fractions(batches, x, matrix),
    )
    total = np.sum(pa + px, axis=1)
    return np.asarray(np.sum(np.abs(px - pa), axis=1) / (total + floor * np.mean(total)))


def _complete(a: Shapes, x: Shapes, what: str) -> None:
    if np.any(np.isnan(a)) or np.any(np.isnan(x)):
        raise InputError(
            f"{what}: shapes have gaps (NaN); expand the measured shapes first (reduction)"
        )
