"""Updating parameters: a label and a block derivative.

A parameter ``p`` moves a property of some elements: value = base + scale · p. The scale is the base
value itself, so ``p`` is a relative change (the p-value of 3.22), except where the base is zero
today and the problem file gives the size of one unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.registry import ELEMENTS

P_VALUES = ("stiffness", "mass", "damping", "whole")
UNITS = {
    "E": "Pa",
    "nu": "1",
    "G": "Pa",
    "rho": "kg/m^3",
    "A": "m^2",
    "I": "m^4",
    "Iy": "m^4",
    "Iz": "m^4",
    "J": "m^4",
    "thickness": "m",
    "height": "m",
    "width": "m",
    "diameter": "m",
    "wall": "m",
    "k": "N/m",
    "m": "kg",
    "c": "N*s/m",
    "Ixx": "kg*m^2",
    "Iyy": "kg*m^2",
    "Izz": "kg*m^2",
    "eta": "1",
    "alpha": "1/s",
    "beta": "s",
    "Dx": "1",
    "Dy": "1",
    "D1": "1",
    "Dxy": "1",
    "N": "N",
    "shear": "1",
    "kappa": "1",
    "rotary": "1",
    "Ip": "kg*m^2",
    "omega": "rad/s",
}


@dataclass(frozen=True)
class Target:
    """Elements ``rows`` of block number ``block`` whose ``properties`` move by ``scales``
    (properties, rows) per unit of p."""

    block: int
    rows: Index
    properties: tuple[str, ...]
    scales: Real


@dataclass(frozen=True)
class Parameter:
    """One number to find. ``nominal`` and ``unit_size`` turn p into a physical value: nominal +
    unit_size · p (0 and 1 for a p-value)."""

    name: str
    of: str
    targets: tuple[Target, ...]
    lower: float
    upper: float
    nominal: float
    unit_size: float
    unit: str
    elements: tuple[int, ...] = ()
    group: str | None = None

    def physical(self, p: float) -> float:
        """The value in SI units that belongs to ``p``."""
        return self.nominal + self.unit_size * p

    def members(self) -> int:
        """Number of elements it moves."""
        return int(np.sum([len(t.rows) for t in self.targets]))


def unit_of(of: str) -> str:
    """Unit of a property, those of elements from outside too; "1" where none is known."""
    own = (kind.text.units.get(of) for kind in ELEMENTS.members())
    return UNITS.get(of) or next((unit for unit in own if unit is not None), "1")
