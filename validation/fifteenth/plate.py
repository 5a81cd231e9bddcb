"""Sheets: bilinear Mindlin quadrilaterals with assumed shears (four points tied)."""

from __future__ import annotations

import functools
import operator
from typing import Any

import numpy as np

from validation.fifteenth.shapes import Effect, Structure
from validation.fifteenth.system import Array, Rows, System

G1 = 1 / np.sqrt(3)


def _bilinear(r: float, s: float) -> tuple[Array, Array, Array]:
    cr, cs = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    return (1 + cr * r) * (1 + cs * s) / 4, cr * (1 + cs * s) / 4, cs * (1 + cr * r) / 4


def _shear(r: float, s: float, hx: float, hy: float, along: int) -> Array:
    """Row of one shear strain at a point; DOFs w, rx, ry of each corner; u = z ry, v = -z rx."""
    n, dr, ds = _bilinear(r, s)
    row = np.zeros(12)
    if along == 0:
        row[0::3], row[2::3] = dr * 2 / hx, n
    else:
        row[0::3], row[1::3] = ds * 2 / hy, -n
    return row


def matrices(
    hx: float, hy: float, t: float, E: float, nu: float, rho: float
) -> tuple[Array, Array]:
    """K and M of a rectangle."""
    d = E * t**3 / 12 / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    g = 5 / 6 * E / (2 * (1 + nu)) * t
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    for r in (-G1, G1):
        for s in (-G1, G1):
            n, dr, ds = _bilinear(r, s)
            b = np.zeros((3, 12))
            b[0, 2::3] = b[2, 1::3] = 0
            b[0, 2::3] = dr * 2 / hx
            b[1, 1::3] = -ds * 2 / hy
            b[2, 2::3], b[2, 1::3] = ds * 2 / hy, -dr * 2 / hx
            gx = (1 - s) / 2 * _shear(0, -1, hx, hy, 0) + (1 + s) / 2 * _shear(0, 1, hx, hy, 0)
            gy = (1 - r) / 2 * _shear(-1, 0, hx, hy, 1) + (1 + r) / 2 * _shear(1, 0, hx, hy, 1)
            w = hx * hy / 4
            k += w * (b.T @ d @ b + g * (np.outer(gx, gx) + np.outer(gy, gy)))
            for off, inertia in ((0, rho * t), (1, rho * t**3 / 12), (2, rho * t**3 / 12)):
                row = np.zeros(12)
                row[off::3] = n
                m += w * inertia * np.outer(row, row)
    return k, m


class Sheet(System):
    """A rectangular sheet; places are (x, y)."""

    def __init__(
        self, structure: Structure, effects: list[Effect], scatter: dict[str, tuple[float, float]]
    ) -> None:
        super().__init__()
        assert structure.plate is not None
        p = self.p = structure.plate
        self.nx, self.ny = 4 * p.nx + 3, 4 * p.ny + 3
        self.hx, self.hy = p.a / self.nx, p.b / self.ny
        self.new(3 * (self.nx + 1) * (self.ny + 1))
        fe, fr = scatter["plate"]
        for i in range(self.nx):
            for j in range(self.ny):
                self._element(i, j, effects, p.material.E * fe, p.material.rho * fr)
        self._edges(effects)

    def _dofs(self, i: int, j: int) -> list[int]:
        n = 3 * (i * (self.ny + 1) + j)
        return [n, n + 1, n + 2]

    def _corners(self, i: int, j: int) -> Any:
        return np.array(
            functools.reduce(
                operator.iadd,
                (self._dofs(*c) for c in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))),
                [],
            )
        )

    def _element(self, i: int, j: int, effects: list[Effect], E: float, rho: float) -> None:
        t, x, y = self.p.t, (i + 0.5) * self.hx, (j + 0.5) * self.hy
        for e in effects:
            if e.kind == "patch":
                x0, x1, y0, y1 = e.at
                if x0 <= x <= x1 and y0 <= y <= y1:
                    t *= e.numbers["height"]
        k, m = matrices(self.hx, self.hy, t, E, self.p.material.nu, rho)
        idx = self._corners(i, j)
        self.add("K", idx, k)
        self.add("M", idx, m)

    def _edges(self, effects: list[Effect]) -> None:
        """Clamped edges: w held; rotations held, or by springs per metre (effect ``edge``)."""
        give = {e.at: e.numbers["kr"] for e in effects if e.kind == "edge"}
        lines = {
            "left": [(0, j) for j in range(self.ny + 1)],
            "right": [(self.nx, j) for j in range(self.ny + 1)],
            "bottom": [(i, 0) for i in range(self.nx + 1)],
            "top": [(i, self.ny) for i in range(self.nx + 1)],
        }
        for edge in self.p.clamped:
            step = self.hy if edge in ("left", "right") else self.hx
            for c in lines[edge]:
                w, rx, ry = self._dofs(*c)
                across, other = (ry, rx) if edge in ("left", "right") else (rx, ry)
                self.fixed.update((w, other))
                if edge in give:
                    self.add("K", np.array([across]), np.array([[give[edge] * step]]))
                else:
                    self.fixed.add(across)

    def rows(self, at: Any) -> Rows:
        """Motions of a place (x, y): z, rx and ry."""
        x, y = at[0] / self.hx, at[1] / self.hy
        i, j = min(max(int(x), 0), self.nx - 1), min(max(int(y), 0), self.ny - 1)
        n, _, _ = _bilinear(2 * (x - i) - 1, 2 * (y - j) - 1)
        b = np.zeros((6, 12))
        for row, off in ((2, 0), (3, 1), (4, 2)):
            b[row, off::3] = n
        return self._corners(i, j), b
