"""What a case is made of: sections, members, effects, tests."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any

DOFS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Section:
    """A cross-section: kind and its sizes [m]; b along local y, h along local z."""

    kind: str  # rect | box | tube | rod
    b: float
    h: float = 0.0
    t: float = 0.0

    def values(self, factor: float = 1.0) -> tuple[float, float, float, float, float]:
        """A, Iy, Iz, J, shear coefficient; ``factor`` scales the height (hollow: the wall)."""
        b, h, t = self.b, self.h, self.t
        if self.kind == "rod":
            d = b * factor
            return pi * d**2 / 4, pi * d**4 / 64, pi * d**4 / 64, pi * d**4 / 32, 0.886
        if self.kind == "rect":
            h *= factor
            lo, hi = min(b, h), max(b, h)
            j = hi * lo**3 * (1 / 3 - 0.21 * lo / hi * (1 - lo**4 / (12 * hi**4)))
            return b * h, b * h**3 / 12, h * b**3 / 12, j, 0.85
        t *= factor
        if self.kind == "tube":
            d = b - 2 * t
            i = pi * (b**4 - d**4) / 64
            return pi * (b**2 - d**2) / 4, i, i, 2 * i, 0.53
        bi, hi = b - 2 * t, h - 2 * t
        j = 2 * t * (b - t) ** 2 * (h - t) ** 2 / ((b - t) + (h - t))
        return b * h - bi * hi, (b * h**3 - bi * hi**3) / 12, (h * b**3 - hi * bi**3) / 12, j, 0.44

    def toml(self) -> str:
        """The section as the analyst writes it."""
        if self.kind == "rect":
            return f'shape = "rectangle"\nwidth = {self.b}\nheight = {self.h}'
        if self.kind in ("tube", "rod"):
            wall = f"\nwall = {self.t}" if self.kind == "tube" else ""
            return f'shape = "circle"\ndiameter = {self.b}{wall}'
        a, iy, iz, j, _ = self.values()
        return f'shape = "general"\nA = {a:.6g}\nIy = {iy:.6g}\nIz = {iz:.6g}\nJ = {j:.6g}'


@dataclass(frozen=True)
class Material:
    """An isotropic material as handbooks have it."""

    name: str
    E: float
    rho: float
    nu: float


STEEL = Material("steel", 210e9, 7850.0, 0.3)
ALU = Material("aluminium", 70e9, 2700.0, 0.33)
BRASS = Material("brass", 100e9, 8450.0, 0.34)


@dataclass
class Member:
    """A straight member between two points, of n elements in the analyst's mesh."""

    name: str
    a: str
    b: str
    section: Section
    n: int
    group: str
    material: Material = STEEL


@dataclass
class Chain:
    """Carts (mass) joined by springs (k, own mass); the first spring is to the wall."""

    carts: list[float]
    springs: list[float]
    spring_mass: float = 0.05


@dataclass
class Plate:
    """A rectangular sheet in x-y, nx by ny elements in the analyst's mesh."""

    a: float
    b: float
    t: float
    nx: int
    ny: int
    clamped: tuple[str, ...] = ()
    material: Material = ALU


@dataclass
class Structure:
    """What the drawing says."""

    points: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    members: list[Member] = field(default_factory=list)
    held: dict[str, tuple[str, ...]] = field(default_factory=dict)
    lumps: dict[str, float] = field(default_factory=dict)  # at points, on the drawing
    dofs: tuple[str, ...] = DOFS
    plate: Plate | None = None
    chain: Chain | None = None


@dataclass
class Effect:
    """What the drawing does not show. ``at``: (member, s), a point's name, (x, y) of a plate."""

    kind: str
    at: Any = None
    numbers: dict[str, Any] = field(default_factory=dict)
    says: str = ""


@dataclass
class Case:
    """One virtual test."""

    name: str
    kind: str  # frf | modes
    title: str
    words: str
    structure: Structure
    sensors: list[tuple[Any, Any, str]]  # (member or i, index, dof)
    drives: list[tuple[Any, Any, str]]
    rig: list[Effect]
    concealed: list[Effect]
    seed: int
    n_modes: int
    zeta: float = 0.006
    reference: bool = False
    holdout: tuple[Any, Any, str] | None = None
    sensor_mass: float = 0.0
    force_gain: float = 1.0
    hammer: bool = True
    averages: int = 20
    noise: float = 0.005
    f_scatter: float = 0.002
    s_scatter: float = 0.02
    lines: int = 1200
