"""Cross-sections: from drawn dimensions to A, Iy, Iz, J. Complex values pass through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from cvxupdate.fe.surroundings import Surroundings
from cvxupdate.fe.terms import Values
from cvxupdate.spec.elements import LineRow
from cvxupdate.spec.model import Material

FACTORS = ("A", "Iy", "Iz", "J")


class Section(Protocol):
    """A shape of cross-section; ``properties`` are its dimensions."""

    @property
    def properties(self) -> tuple[str, ...]:
        """Names of the dimensions."""

    def constants(self, p: Mapping[str, Values]) -> dict[str, Values]:
        """A (m²), Iy, Iz, J (m⁴) from the dimensions, before the factors of the same names."""


@dataclass(frozen=True)
class Rectangle:
    """Width along local y, height along local z."""

    properties: tuple[str, ...] = ("width", "height")

    def constants(self, p: Mapping[str, Values]) -> dict[str, Values]:
        """J by Roark's formula for a solid rectangle (Young and Budynas, table 10.7)."""
        w, h = p["width"], p["height"]
        swap = np.real(w) < np.real(h)
        a, b = np.where(swap, h, w), np.where(swap, w, h)
        J = a * b**3 * (1.0 / 3.0 - 0.21 * (b / a) * (1.0 - (b / a) ** 4 / 12.0))
        return {"A": w * h, "Iy": w * h**3 / 12.0, "Iz": h * w**3 / 12.0, "J": J}


@dataclass(frozen=True)
class Circle:
    """Solid round bar, or a tube where ``wall`` (m) is not zero."""

    properties: tuple[str, ...] = ("diameter", "wall")

    def constants(self, p: Mapping[str, Values]) -> dict[str, Values]:
        """Solid or hollow circle; J = 2 I."""
        d = p["diameter"]
        inner = np.where(np.real(p["wall"]) > 0.0, d - 2.0 * p["wall"], 0.0 * d)
        I = np.pi * (d**4 - inner**4) / 64.0
        return {"A": np.pi * (d**2 - inner**2) / 4.0, "Iy": I, "Iz": I, "J": 2.0 * I}


@dataclass(frozen=True)
class General:
    """A, Iy, Iz, J given: the factors carry the values themselves."""

    properties: tuple[str, ...] = ()

    def constants(self, p: Mapping[str, Values]) -> dict[str, Values]:
        """Ones; the stored A, Iy, Iz, J are the constants."""
        one = np.ones_like(p["A"])
        return {"A": one, "Iy": one, "Iz": one, "J": one}


def section_constants(section: Section, p: Mapping[str, Values]) -> dict[str, Values]:
    """A, Iy, Iz, J with the factors applied, each (elements,)."""
    return {k: v * p[k] for k, v in section.constants(p).items()}


def shape_of(text: Any) -> Section:
    """The shape that a section of the problem file has."""
    known: dict[str, Section] = {"rectangle": Rectangle(), "circle": Circle(), "general": General()}
    return known[text.shape]


def shear_modulus(p: Mapping[str, Values]) -> Values:
    """G of a rod or beam: the material's own where the file gives it, else that of E and nu.

    A G of the file is independent of E, so E moves bending and tension only; without it E carries
    the torsion along. ``p["G"]`` is 0 where the file gives none.
    """
    own = np.real(p["G"]) != 0.0
    return np.where(own, p["G"], p["E"] / (2.0 * (1.0 + p["nu"])))


def material_properties(material: Material) -> dict[str, float]:
    """E, nu (that of E and G where G is given) and rho."""
    nu = material.nu if material.G is None else material.E / (2.0 * material.G) - 1.0
    return {"E": material.E, "nu": nu, "rho": material.rho}


_DIMENSIONS = ("width", "height", "diameter", "wall")


def line_properties(row: LineRow, around: Surroundings) -> dict[str, float]:
    """Material, dimensions, section factors, preload and shear of a rod or beam."""
    section: Any = around.section(row)
    material = around.material(row)
    out = {**material_properties(material), "G": material.G or 0.0}
    keys = type(section).model_fields
    out |= {k: getattr(section, k) or 0.0 if k in keys else 1.0 for k in FACTORS}
    out |= {k: getattr(section, k) or 0.0 for k in _DIMENSIONS if k in keys}
    out["N"] = row.N
    out["corner"] = 0.0
    if section.kappa is None:
        return {**out, "shear": 0.0, "kappa": shear_coefficient(section, out["nu"])}
    return {**out, "shear": 1.0, "kappa": section.kappa}


def shear_coefficient(section: Any, nu: float) -> float:
    """kappa of a section for which the file gives none: 5/6, or that of a round bar or tube (Cowper
    1966, hollow circle)."""
    if section.shape != "circle":
        return 5.0 / 6.0
    inner = 1.0 - 2.0 * section.wall / section.diameter if section.wall else 0.0
    ring = (1.0 + inner**2) ** 2
    return 6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * inner**2)
