"""Rectangular plate in bending: the twelve-DOF element of Adini, Clough and Melosh, isotropic or
orthotropic (thesis 8.4).

Derived from its twelve-term polynomial, because (8.5) and (8.6) are misprinted (errata). The DOFs
of a node are w, θx = ∂w/∂y, θy = −∂w/∂x. Energy: ½ ∫ Dx w_xx² + 2 D1 w_xx w_yy + Dy w_yy² + 4 Dxy
w_xy² dA (Timoshenko and Woinowsky-Krieger, ch. 11); isotropic Dx = Dy = D, D1 = ν D, Dxy = (1 − ν)
D / 2, D = E h³ / 12 (1 − ν²).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, cast

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.sections import material_properties
from cvxupdate.spec import division
from cvxupdate.spec.elements import ELASTIC, INERTIAL, ElementText, Lacking, PlateBlock, PlateRow
from cvxupdate.spec.model import PlateSection

KAPPA = 5.0 / 6.0  # of a sheet in shear (Reissner)
RIM = 0.63 / 6.0  # of G h⁴: what a free edge lacks of the torsional stiffness G h³ / 3 a metre
_POWERS = (
    (0, 0),
    (1, 0),
    (0, 1),
    (2, 0),
    (1, 1),
    (0, 2),
    (3, 0),
    (2, 1),
    (1, 2),
    (0, 3),
    (3, 1),
    (1, 3),
)
_CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def _rows(x: float, y: float, dx: int, dy: int) -> Real:
    """The dx, dy-th derivative of each monomial at a point."""
    out = np.zeros(12)
    for i, (a, b) in enumerate(_POWERS):
        if a >= dx and b >= dy:
            ca = np.prod([a - k for k in range(dx)], initial=1.0)
            cb = np.prod([b - k for k in range(dy)], initial=1.0)
            out[i] = ca * cb * x ** (a - dx) * y ** (b - dy)
    return out


@lru_cache(maxsize=1)
def unit_matrices() -> dict[str, Real]:
    """12 × 12 factors on the unit square for the DOFs (w, ∂w/∂ξ, ∂w/∂η) at the four corners."""
    corners = np.vstack([_rows(x, y, *d) for x, y in _CORNERS for d in ((0, 0), (1, 0), (0, 1))])
    shape = np.linalg.inv(corners)
    points, weights = np.polynomial.legendre.leggauss(4)
    out = {key: np.zeros((12, 12)) for key in ("Dx", "Dy", "D1", "Dxy", "rhoh", "wxx", "wyy")}
    for px, wx in zip((points + 1) / 2, weights / 2, strict=True):
        for py, wy in zip((points + 1) / 2, weights / 2, strict=True):
            w, xx, yy, xy = (_rows(px, py, *d) @ shape for d in ((0, 0), (2, 0), (0, 2), (1, 1)))
            q = wx * wy
            out["Dx"] += q * np.outer(xx, xx)
            out["Dy"] += q * np.outer(yy, yy)
            out["D1"] += q * (np.outer(xx, yy) + np.outer(yy, xx))
            out["Dxy"] += 4.0 * q * np.outer(xy, xy)
            out["rhoh"] += q * np.outer(w, w)
            out["wxx"] += q / 2.0 * (np.outer(w, xx) + np.outer(xx, w))
            out["wyy"] += q / 2.0 * (np.outer(w, yy) + np.outer(yy, w))
    return out


def _lacking(block: PlateBlock, active: tuple[str, ...]) -> Lacking:
    absent = sorted({"z", "rx", "ry"}.difference(active))
    if not absent:
        return None
    return (
        f"plate elements need z, rx and ry; {', '.join(absent)} not active.",
        "Add them to model.dofs.",
    )


def _unit_dofs(ex: Real, ey: Real) -> Real:
    """(e, 12, 12): the DOFs on the unit square from those of elements with sides ex, ey (e, 3)."""
    e = len(ex)
    S = np.zeros((e, 4, 3, 4, 3))
    for n in range(4):
        S[:, n, 0, n, 0] = 1.0
        S[:, n, 1, n, 1], S[:, n, 1, n, 2] = (
            ex[:, 1],
            -ex[:, 0],
        )  # ∂w/∂ξ = a·(∇w · x̂) = ex_y θx − ex_x θy
        S[:, n, 2, n, 1], S[:, n, 2, n, 2] = ey[:, 1], -ey[:, 0]
    return S.reshape(e, 12, 12)


def edge_curvature(xyz: Real, axis: int, end: int) -> Real:
    """∫ w_nn² ds (e, 12, 12) along the edge of elements ``xyz`` (e, 4, 3) where local x (``axis``
    0) or y is at its beginning (``end`` 0) or its end (1), n along that axis."""
    ex, ey = xyz[:, 1] - xyz[:, 0], xyz[:, 3] - xyz[:, 0]
    a, b = np.linalg.norm(ex, axis=1), np.linalg.norm(ey, axis=1)
    corners = np.vstack([_rows(x, y, *d) for x, y in _CORNERS for d in ((0, 0), (1, 0), (0, 1))])
    shape, unit = np.linalg.inv(corners), np.zeros((12, 12))
    points, weights = np.polynomial.legendre.leggauss(4)
    for t, w in zip((points + 1) / 2, weights / 2, strict=True):
        x, y = (float(end), t) if axis == 0 else (t, float(end))
        bent = _rows(x, y, *((2, 0) if axis == 0 else (0, 2))) @ shape
        unit += w * np.outer(bent, bent)
    T, size = _unit_dofs(ex, ey), (b / a**4 if axis == 0 else a / b**4)
    return np.einsum("eki,kl,elj->eij", T, unit, T, optimize=True) * size[:, None, None]


def lagging(xyz: Real) -> Real:
    """−∫ w ∇²w dA (e, 12, 12), symmetric, of elements ``xyz`` (e, 4, 3)."""
    ex, ey = xyz[:, 1] - xyz[:, 0], xyz[:, 3] - xyz[:, 0]
    a, b = np.linalg.norm(ex, axis=1), np.linalg.norm(ey, axis=1)
    T, unit = _unit_dofs(ex, ey), unit_matrices()
    along, across = b / a, a / b
    whole = unit["wxx"] * along[:, None, None] + unit["wyy"] * across[:, None, None]
    return -np.einsum("eki,ekl,elj->eij", T, whole, T, optimize=True)


@dataclass(frozen=True)
class Plate:
    """Dx, Dy, D1, Dxy are factors on the isotropic rigidities, 1 for an isotropic sheet; ``clamp``
    is by how many thicknesses clamped edges hold it beyond the line of their nodes; ``lag`` and
    ``turning`` are how much of the shear and rotary inertia of a solid it has, on finer parts."""

    mass: str = "consistent"
    name: str = "plate"
    nodes: int = 4
    dofs: tuple[str, ...] = ("z", "rx", "ry")
    properties: tuple[str, ...] = (
        "E",
        "nu",
        "rho",
        "thickness",
        "Dx",
        "Dy",
        "D1",
        "Dxy",
        "clamp",
        "lag",
        "turning",
    )
    text: ClassVar[ElementText] = ElementText(
        PlateBlock,
        changes=(*ELASTIC, *INERTIAL, "nu", "thickness", "Dx", "Dy", "D1", "Dxy"),
        outline="rectangle",
        divide=division.surface,
        sections={"plate": ()},
        lacking=_lacking,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: PlateRow, block: PlateBlock, around: Surroundings) -> Iterator[Placed]:
        """One plate element."""
        s = cast(PlateSection, around.section(row))
        rigidities = {"Dx": s.Dx, "Dy": s.Dy, "D1": s.D1, "Dxy": s.Dxy}
        properties = {**material_properties(around.material(row)), "thickness": s.thickness}
        properties |= {"clamp": 0.0, "lag": 1.0, "turning": 1.0}
        yield Placed(cls(block.mass), {**properties, **rigidities})

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors, (e, 12, 12). Local x runs from the first node to the second, local y
        to the fourth.

        Raises
        ------
        ModelError
            When an element is not a rectangle in a plane z = constant.
        """
        ex, ey = xyz[:, 1] - xyz[:, 0], xyz[:, 3] - xyz[:, 0]
        a, b = np.linalg.norm(ex, axis=1), np.linalg.norm(ey, axis=1)
        skew = np.abs(np.einsum("ei,ei->e", ex, ey)) > 1e-6 * a * b
        open_ = np.linalg.norm(xyz[:, 2] - xyz[:, 0] - ex - ey, axis=1) > 1e-6 * (a + b)
        tilted = (np.abs(ex[:, 2]) > 1e-6 * a) | (np.abs(ey[:, 2]) > 1e-6 * b)
        if np.any((a == 0) | (b == 0) | skew | open_ | tilted):
            raise ModelError(
                "a plate element is not a rectangle parallel to the x-y plane, or its nodes "
                "are not in order around it. Order its four nodes around a rectangle."
            )
        T = _unit_dofs(ex, ey)
        scale = {
            "Dx": b / a**3,
            "Dy": a / b**3,
            "D1": 1.0 / (a * b),
            "Dxy": 1.0 / (a * b),
            "rhoh": a * b,
        }
        unit = dict(unit_matrices())
        if self.mass == "lumped":
            unit["rhoh"] = np.diag(np.tile([0.25, 0.0, 0.0], 4))
        return tuple(
            Term(
                "M" if key == "rhoh" else "K",
                key,
                np.einsum("eki,kl,elj->eij", T, unit[key], T, optimize=True)
                * scale[key][:, None, None],
            )
            for key in scale
        )

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Rigidities in N·m, mass per area in kg/m²."""
        nu, h = properties["nu"], properties["thickness"]
        D = properties["E"] * h**3 / (12.0 * (1.0 - nu**2))
        sheared = properties["lag"]
        lag = sheared * h**2 / (6.0 * KAPPA * (1.0 - nu))  # D / κGh
        return {
            "Dx": properties["Dx"] * D,
            "Dy": properties["Dy"] * D,
            "D1": properties["D1"] * nu * D,
            "Dxy": properties["Dxy"] * (1.0 - nu) / 2.0 * D,
            "rhoh": properties["rho"] * h,
            # of a solid sheet: see cvxupdate.fe.analysis.solid
            "rim": sheared * properties["Dxy"] * RIM * properties["E"] / (2.0 * (1.0 + nu)) * h**4,
            "turning": properties["turning"] * properties["rho"] * h**3 / 12.0,
            "lag": properties["rho"] * h * lag,
            "lagged": properties["rho"] * h * lag**2 / 4.0,
            "clampx": properties["clamp"] * h * properties["Dx"] * D,
            "clampy": properties["clamp"] * h * properties["Dy"] * D,
        }
