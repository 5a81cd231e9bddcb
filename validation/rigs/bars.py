"""Matrices of a bar in space: stiffness with shear (Przemieniecki 1968, eq. 5.116), consistent mass
(Friedman and Kosmatka 1993, eq. 41)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def axes(along: Real) -> Real:
    """Rows: local x, y, z of a bar in global axes; local z is near global z where it can be."""
    x = along / np.linalg.norm(along)
    near = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    y = np.cross(near, x)
    y /= np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)])


def stiffness(EA: float, EIy: float, EIz: float, GJ: float, h: float, GAs: float) -> Real:
    """12 × 12 of a bar of length h in local axes (u, v, w, turns) at both ends."""
    K, pair = np.zeros((12, 12)), np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[np.ix_([0, 6], [0, 6])] = EA / h * pair
    K[np.ix_([3, 9], [3, 9])] = GJ / h * pair
    for rows, EI, sign in (([1, 5, 7, 11], EIz, 1.0), ([2, 4, 8, 10], EIy, -1.0)):
        p = 12.0 * EI / (GAs * h**2)
        a, b = (4.0 + p) * h**2, (2.0 - p) * h**2
        values = np.array(
            [
                [12.0, 6.0 * h, -12.0, 6.0 * h],
                [6.0 * h, a, -6.0 * h, b],
                [-12.0, -6.0 * h, 12.0, -6.0 * h],
                [6.0 * h, b, -6.0 * h, a],
            ]
        )
        turn = np.array([1.0, sign, 1.0, sign])
        K[np.ix_(rows, rows)] = EI / (h**3 * (1.0 + p)) * values * np.outer(turn, turn)
    return K


def inertia(
    m: float, jy: float, jz: float, h: float, rotary: bool, phi: tuple[float, float] = (0.0, 0.0)
) -> Real:
    """12 × 12 consistent mass of a bar with m kg/m and rotary inertias jy, jz kg·m; ``phi`` are its
    shear numbers 12 EI / (G As h²) about y and z (Friedman and Kosmatka 1993, eq. 41)."""
    M, rod = np.zeros((12, 12)), np.array([[2.0, 1.0], [1.0, 2.0]]) * h / 6.0
    M[np.ix_([0, 6], [0, 6])] = m * rod
    M[np.ix_([3, 9], [3, 9])] = (jy + jz) * rod
    planes = (([1, 5, 7, 11], jz, phi[1], 1.0), ([2, 4, 8, 10], jy, phi[0], -1.0))
    for rows, j, p, sign in planes:
        a, b = 70.0 * p**2 + 147.0 * p + 78.0, (35.0 * p**2 + 77.0 * p + 44.0) * h / 4.0
        c, d = 35.0 * p**2 + 63.0 * p + 27.0, (35.0 * p**2 + 63.0 * p + 26.0) * h / 4.0
        e, f = ((7.0 * p**2 + 14.0 * p + x) * h**2 / 4.0 for x in (8.0, 6.0))
        values = (m * h / (210.0 * (1.0 + p) ** 2)) * np.array(
            [[a, b, c, -d], [b, e, d, -f], [c, d, a, -b], [-d, -f, -b, e]]
        )
        if rotary:
            b, e = (3.0 - 15.0 * p) * h, (10.0 * p**2 + 5.0 * p + 4.0) * h**2
            f = (5.0 * p**2 - 5.0 * p - 1.0) * h**2
            values += (j / (30.0 * h * (1.0 + p) ** 2)) * np.array(
                [[36.0, b, -36.0, b], [b, e, -b, f], [-36.0, -b, 36.0, -b], [b, f, -b, e]]
            )
        turn = np.array([1.0, sign, 1.0, sign])
        M[np.ix_(rows, rows)] = values * np.outer(turn, turn)
    return M
