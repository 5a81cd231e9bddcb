"""How a mode shape of the model is compared with a measured one: rows, and their derivative with
respect to the shape at the sensors.

A deviation of zero says that an entry is fixed by normalisation: the measured shape was divided by
it, so it tells nothing by itself (rounding of zero counts as zero).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real

ZERO = 1e-9  # of the largest deviation of a shape: below, it is rounding of zero
DARK = 1e-6  # √MAC below which two shapes have nothing in common


@dataclass(frozen=True)
class ShapeRows:
    """``values`` (k,), their ``weights`` (k,), and ``entry`` (k,): the sensor of each row, −1 where
    a row is of the whole shape."""

    values: Real
    weights: Real
    entry: Index


class ShapeForm(Protocol):
    """A way to compare shapes ``phi`` (model) and ``x`` (measured), both (sensors,), with the
    deviations ``std``, 0 where an entry is fixed by normalisation."""

    def rows(self, phi: Real, x: Real, std: Real) -> ShapeRows:
        """The differences."""

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """∂values/∂φ (k, sensors)."""

    def misfits(self, phi: Real, x: Real, std: Real) -> Real:
        """Weighted squares (m,) of each of the shapes ``phi`` (sensors, m), as `rows` has them."""


def deviations(std: Real, x: Real, unstated: float, where: str) -> Real:
    """Deviations of one shape: ``unstated`` of its largest entry where the table has none (NaN), 0
    where an entry is fixed by normalisation.

    Raises
    ------
    RecordingError
        When every stated deviation is zero: then none is fixed by the others.
    """
    known = np.isfinite(std)
    largest = float(np.max(std[known], initial=0.0))
    if np.any(known) and largest == 0.0:
        raise RecordingError(
            f"{where}: every deviation of its shape is 0. A zero says that an entry is fixed by "
            "normalisation: give the deviations of the others, or none."
        )
    out = np.where(known, std, unstated * np.max(np.abs(x), initial=0.0))
    return np.where(known & (std <= ZERO * largest), 0.0, out)


@dataclass(frozen=True)
class ModalScale:
    """Entries of the shape scaled to the measured one by weighted least squares (the modal scale
    factor, 2.3). Entries fixed by normalisation are left out of both."""

    def rows(self, phi: Real, x: Real, std: Real) -> ShapeRows:
        """q φ − x at the sensors that have a deviation."""
        free = np.flatnonzero(std > 0.0)
        q = _scale_factor(phi[free], x[free], std[free])
        return ShapeRows(q * phi[free] - x[free], 1.0 / std[free], free)

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """With the change of the scale factor."""
        free = np.flatnonzero(std > 0.0)
        out = np.zeros((len(free), len(phi)))
        w = 1.0 / std[free] ** 2
        q = _scale_factor(phi[free], x[free], std[free])
        dq = w * (x[free] - 2.0 * q * phi[free]) / np.sum(w * phi[free] ** 2)
        out[:, free] = q * np.eye(len(free)) + np.outer(phi[free], dq)
        return out

    def misfits(self, phi: Real, x: Real, std: Real) -> Real:
        """Of all shapes together."""
        free = np.flatnonzero(std > 0.0)
        w, seen, y = 1.0 / std[free] ** 2, phi[free], x[free]
        q = (w * y) @ seen / (w @ seen**2)
        return np.asarray(w @ (q * seen - y[:, None]) ** 2)


@dataclass(frozen=True)
class Difference:
    """Entries of the shape divided as the measured one is: both are equal at the entry that is
    fixed by normalisation (the largest measured entry where none is)."""

    def rows(self, phi: Real, x: Real, std: Real) -> ShapeRows:
        """φ x_f / φ_f − x at the other sensors."""
        at, others = held_entry(x, std)
        scaled = phi[others] * _ratio(phi, x, at)
        return ShapeRows(scaled - x[others], 1.0 / std[others], others)

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """With the change of the entry that is held."""
        at, others = held_entry(x, std)
        q = _ratio(phi, x, at)
        out = np.zeros((len(others), len(phi)))
        out[np.arange(len(others)), others] = q
        out[:, at] -= q * phi[others] / phi[at]
        return out

    def misfits(self, phi: Real, x: Real, std: Real) -> Real:
        """Of all shapes together."""
        at, others = held_entry(x, std)
        q = np.array([_ratio(one, x, at) for one in phi.T])
        return np.asarray(std[others] ** -2.0 @ (q * phi[others] - x[others, None]) ** 2)


@dataclass(frozen=True)
class Assurance:
    """One row for a shape, (1 − √MAC)/√MAC with the weight 1/‖σ‖, σ the deviations of the entries
    that are not fixed by normalisation: neither sign nor scale of the shapes counts.

    Source: Dong and Wang (2019), Structural model updating with modal data, formulation 1 (the
    objective published with the footbridge of problems/real/smu-modal-data).
    """

    def rows(self, phi: Real, x: Real, std: Real) -> ShapeRows:
        """One value."""
        s, _ = _cosine(phi, x)
        weight = 1.0 / np.linalg.norm(std)
        return ShapeRows(np.array([1.0 / s - 1.0]), np.array([weight]), np.array([-1]))

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """d(1/s) = −ds/s²."""
        s, sign = _cosine(phi, x)
        size, length = np.linalg.norm(phi), np.linalg.norm(x)
        ds = sign * x / (size * length) - s * phi / size**2
        return np.asarray(-ds[None, :] / s**2)

    def misfits(self, phi: Real, x: Real, std: Real) -> Real:
        """Of all shapes together."""
        s = np.abs(x @ phi) / (np.linalg.norm(phi, axis=0) * np.linalg.norm(x))
        return np.asarray((1.0 / np.maximum(s, DARK) - 1.0) ** 2 / (std @ std))


FORMS: Mapping[str, ShapeForm] = MappingProxyType(
    {"scale": ModalScale(), "difference": Difference(), "mac": Assurance()}
)
"""The forms by the name that [update] shape_residual gives them."""


def _scale_factor(phi: Real, x: Real, std: Real) -> float:
    w = 1.0 / std**2
    return float(np.sum(w * phi * x) / np.sum(w * phi**2))


def held_entry(x: Real, std: Real) -> tuple[int, Index]:
    """The entry at which both shapes are made equal, and the others that have a deviation."""
    fixed = np.flatnonzero(std == 0.0)
    among = fixed if len(fixed) else np.arange(len(x))
    at = int(among[np.argmax(np.abs(x[among]))])
    return at, np.setdiff1d(np.flatnonzero(std > 0.0), [at])


def _ratio(phi: Real, x: Real, at: int) -> float:
    """x_f / φ_f; where the model's shape has a node there, as large as its other entries allow."""
    least = DARK * np.max(np.abs(phi), initial=0.0)
    base = phi[at] if abs(phi[at]) > least else np.copysign(least, phi[at])
    return float(x[at] / base)


def _cosine(phi: Real, x: Real) -> tuple[float, float]:
    """√MAC, not below `DARK`, and the sign of φᵀx."""
    product = float(phi @ x)
    s = abs(product) / float(np.linalg.norm(phi) * np.linalg.norm(x))
    return max(s, DARK), float(np.copysign(1.0, product))
