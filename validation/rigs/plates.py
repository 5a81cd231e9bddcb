"""Plates by a Ritz series of Legendre polynomials: Kirchhoff (thin) or Mindlin (moderately thick).

The analyst's elements are rectangles; the series knows nothing of them but the lines between them,
so that a region of elements can be softer. Energies: Leissa, NASA SP-160 (1969), eq. 1.1–1.14;
Mindlin, J. Appl. Mech. 18 (1951) 31. Node rotations rx = ∂w/∂y, ry = −∂w/∂x.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.polynomial import legendre
from numpy.typing import NDArray

from validation.rigs.drawing import Plate

Real = NDArray[np.float64]
Term = tuple[int, int, int, float]  # field, derivative by x, derivative by y, factor
TERMS = 13  # of the series in each direction
KAPPA = 5.0 / 6.0
W, RX, RY = 0, 1, 2


@dataclass(frozen=True)
class Series:
    """The series on a plate; ``thick``: rotations are fields of their own."""

    plate: Plate
    thick: bool

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return (3 if self.thick else 1) * TERMS**2

    def functional(self, x: float, y: float, dof: str) -> Real:
        """What a node's DOF is, in unknowns."""
        p = self.plate
        field, dx, dy, sign = {
            "z": (W, 0, 0, 1.0),
            "rx": (RX, 0, 0, 1.0) if self.thick else (W, 0, 1, 1.0),
            "ry": (RY, 0, 0, 1.0) if self.thick else (W, 1, 0, -1.0),
        }[dof]
        out = np.zeros((self.size // TERMS**2, TERMS, TERMS))
        out[field] = sign * np.outer(
            polynomials(np.array([x]), p.a, dx)[0], polynomials(np.array([y]), p.b, dy)[0]
        )
        return out.ravel()

    def matrices(
        self, elements: Iterable[int], E: float, nu: float, rho: float, rotary: bool
    ) -> tuple[Real, Real]:
        """(K, M) of a set of elements."""
        p, K, M = self.plate, np.zeros((self.size,) * 2), np.zeros((self.size,) * 2)
        rows: dict[int, list[int]] = {}
        for e in elements:
            rows.setdefault((e - 1) // p.nx, []).append((e - 1) % p.nx)
        same: dict[tuple[int, ...], list[int]] = {}
        for j, at in rows.items():
            same.setdefault(tuple(sorted(at)), []).append(j)
        D, inertia = E * p.h**3 / 12.0 / (1.0 - nu**2), rho * p.h**3 / 12.0
        stiff = self._energies(D, nu, KAPPA * E / (2.0 * (1.0 + nu)) * p.h)
        for columns, lines in same.items():
            I, J = _integrals(p.a, p.nx, columns), _integrals(p.b, p.ny, lines)
            for c, left, right in stiff:
                self._add(K, c, left, right, I, J)
            self._add(M, rho * p.h, [(W, 0, 0, 1.0)], [(W, 0, 0, 1.0)], I, J)
            for part in self._rotations() if rotary or self.thick else ():
                self._add(M, inertia, part, part, I, J)
        return K, M

    def _rotations(self) -> tuple[list[Term], list[Term]]:
        if self.thick:
            return [(RX, 0, 0, 1.0)], [(RY, 0, 0, 1.0)]
        return [(W, 0, 1, 1.0)], [(W, 1, 0, 1.0)]

    def _energies(
        self, D: float, nu: float, shear: float
    ) -> list[tuple[float, list[Term], list[Term]]]:
        """Coefficients and pairs of strains whose product is twice the strain energy."""
        kx: list[Term] = [(RY, 1, 0, 1.0)] if self.thick else [(W, 2, 0, -1.0)]
        ky: list[Term] = [(RX, 0, 1, -1.0)] if self.thick else [(W, 0, 2, -1.0)]
        kxy: list[Term] = [(RY, 0, 1, 1.0), (RX, 1, 0, -1.0)] if self.thick else [(W, 1, 1, -2.0)]
        out = [(D, kx, kx), (D, ky, ky), (nu * D, kx, ky), (nu * D, ky, kx)]
        out.append(((1.0 - nu) / 2.0 * D, kxy, kxy))
        if self.thick:
            gx: list[Term] = [(W, 1, 0, 1.0), (RY, 0, 0, 1.0)]
            gy: list[Term] = [(W, 0, 1, 1.0), (RX, 0, 0, -1.0)]
            out += [(shear, gx, gx), (shear, gy, gy)]
        return out

    def _add(
        self,
        total: Real,
        c: float,
        left: list[Term],
        right: list[Term],
        I: dict[tuple[int, int], Real],
        J: dict[tuple[int, int], Real],
    ) -> None:
        n = TERMS**2
        for f, px, py, a in left:
            for g, qx, qy, b in right:
                block = total[f * n : (f + 1) * n, g * n : (g + 1) * n]
                block += c * a * b * np.kron(I[px, qx], J[py, qy])

    def clamped(self, give: str) -> Real:
        """Rows that vanish where the edge x = 0 is clamped. ``give``: "" nothing gives, "turn" the
        edge may turn (springs hold it), "body" it moves with a rigid fixture (heave and pitch)."""
        fields = [("z", 0), ("rx", 0), ("ry", 0)] if self.thick else [("z", 0), ("ry", 0)]
        if give == "turn":
            fields = fields[:-1]
        rows = []
        for dof, _ in fields:
            for j in range(1 if give == "body" and dof in ("z", "ry") else 0, TERMS):
                out = np.zeros((self.size // TERMS**2, TERMS, TERMS))
                field = {"z": W, "rx": RX, "ry": RY}[dof] if self.thick else W
                slope = 1 if not self.thick and dof == "ry" else 0
                out[field][:, j] = polynomials(np.array([0.0]), self.plate.a, slope)[0]
                rows.append(out.ravel())
        return np.array(rows)

    def edge_springs(self, k: float) -> Real:
        """Stiffness of springs k N·m/rad for each metre of the edge x = 0 against its turning."""
        p = self.plate
        J = _integrals(p.b, p.ny, range(p.ny))[0, 0]
        K = np.zeros((self.size,) * 2)
        slope = polynomials(np.array([0.0]), p.a, 0 if self.thick else 1)[0]
        n, at = TERMS**2, RY if self.thick else W
        K[at * n : (at + 1) * n, at * n : (at + 1) * n] = k * np.kron(np.outer(slope, slope), J)
        return K


def polynomials(x: Real, length: float, derivative: int) -> Real:
    """(points, terms): normalised Legendre polynomials on 0 … length, or their derivatives."""
    norms = np.sqrt(np.arange(TERMS) + 0.5)
    series = legendre.legder(np.eye(TERMS), derivative) if derivative else np.eye(TERMS)
    values = legendre.legval(2.0 * x / length - 1.0, series)
    return np.asarray((2.0 / length) ** derivative * norms * values.T)


def _integrals(length: float, parts: int, chosen: Iterable[int]) -> dict[tuple[int, int], Real]:
    """∫ P_i^(p) P_j^(q) over the chosen of ``parts`` equal intervals, p and q up to 2; exact."""
    point, weight = legendre.leggauss(TERMS)
    h = length / parts
    x = np.concatenate([h * (c + (point + 1.0) / 2.0) for c in chosen])
    w = np.tile(weight * h / 2.0, len(x) // len(point))
    P = [polynomials(x, length, d) for d in range(3)]
    return {(p, q): (P[p] * w[:, None]).T @ P[q] for p in range(3) for q in range(3)}


def null_space(rows: Real, size: int) -> Real:
    """An orthonormal basis of what all rows leave free."""
    if not len(rows):
        return np.eye(size)
    return np.asarray(sl.null_space(rows / np.linalg.norm(rows, axis=1)[:, None]))
