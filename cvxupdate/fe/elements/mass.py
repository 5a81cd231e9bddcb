"""Lumped mass at a node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.elements.base import Real, Term, Values

_PLACES = {"m": (0, 1, 2), "Ixx": (3,), "Iyy": (4,), "Izz": (5,)}


@dataclass(frozen=True)
class Mass:
    """m on the translations, Ixx, Iyy, Izz about the node on the rotations."""

    name: str = "mass"
    nodes: int = 1
    dofs: tuple[str, ...] = ("x", "y", "z", "rx", "ry", "rz")
    properties: tuple[str, ...] = ("m", "Ixx", "Iyy", "Izz")

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Unit masses."""
        out = []
        for name, places in _PLACES.items():
            unit = np.zeros((len(xyz), 6, 6))
            unit[:, places, places] = 1.0
            out.append(Term("M", name, unit))
        return tuple(out)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """m in kg, inertias in kg·m²."""
        return {name: properties[name] for name in _PLACES}
