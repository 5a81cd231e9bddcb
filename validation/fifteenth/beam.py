"""A Timoshenko beam in space: interpolation, stiffness and consistent mass by quadrature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GAUSS = np.polynomial.legendre.leggauss(4)


def _plane(xi: float, length: float, phi: float) -> tuple[Array, Array, Array]:
    """Deflection, turning and its slope from v1, t1, v2, t2 (t = dv/dx without shear)."""
    d = 1 + phi
    bub = phi / 2 * (xi - xi**2)
    v = (
        np.array(
            [
                1 - 3 * xi**2 + 2 * xi**3 + phi * (1 - xi),
                length * (xi - 2 * xi**2 + xi**3 + bub),
                3 * xi**2 - 2 * xi**3 + phi * xi,
                length * (xi**3 - xi**2 - bub),
            ]
        )
        / d
    )
    t = (
        np.array(
            [
                6 * (xi**2 - xi) / length,
                1 - 4 * xi + 3 * xi**2 + phi * (1 - xi),
                -6 * (xi**2 - xi) / length,
                3 * xi**2 - 2 * xi + phi * xi,
            ]
        )
        / d
    )
    dt = np.array(
        [6 * (2 * xi - 1) / length, -4 + 6 * xi - phi, -6 * (2 * xi - 1) / length, 6 * xi - 2 + phi]
    )
    return v, t, dt / (d * length)


def interpolation(xi: float, length: float, phis: tuple[float, float]) -> Array:
    """The six motions (local axes) at xi from the ends' twelve; phis of bending in y and in z."""
    n = np.zeros((6, 12))
    for row in (0, 3):
        n[row, row], n[row, row + 6] = 1 - xi, xi
    v, t, _ = _plane(xi, length, phis[0])
    n[1, [1, 5, 7, 11]], n[5, [1, 5, 7, 11]] = v, t
    v, t, _ = _plane(xi, length, phis[1])
    sign = np.array([1, -1, 1, -1])
    n[2, [2, 4, 8, 10]], n[4, [2, 4, 8, 10]] = v * sign, -t * sign
    return n


def _strains(xi: float, length: float, phis: tuple[float, float]) -> Array:
    """Stretch, twist, two curvatures and two shears."""
    b = np.zeros((6, 12))
    b[0, [0, 6]] = b[1, [3, 9]] = [-1 / length, 1 / length]
    sign = np.array([1, -1, 1, -1])
    for row, phi, cols, s in (
        (2, phis[0], [1, 5, 7, 11], np.ones(4)),
        (3, phis[1], [2, 4, 8, 10], sign),
    ):
        _, _, dt = _plane(xi, length, phi)
        b[row, cols] = dt * s
        c = phi / (1 + phi)  # constant shear: (chord turn - mean turn) * c
        b[row + 2, cols] = c * np.array([-1 / length, -0.5, 1 / length, -0.5]) * s
    return b


def matrices(
    length: float, stiff: tuple[float, ...], mass: tuple[float, ...]
) -> tuple[Array, Array, tuple[float, float]]:
    """Local K and M; stiff: EA, GJ, EIz, EIy, kGA; mass by length: rho times A, Ip, Iy, Iz."""
    ea, gj, eiz, eiy, kga = stiff
    phis = (12 * eiz / (kga * length**2), 12 * eiy / (kga * length**2))
    d = np.diag([ea, gj, eiz, eiy, kga, kga])
    g = np.diag([mass[0]] * 3 + [mass[1], mass[2], mass[3]])
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    for x, w in zip(*GAUSS, strict=True):
        xi, w = (x + 1) / 2, w * length / 2
        b, n = _strains(xi, length, phis), interpolation(xi, length, phis)
        k += w * b.T @ d @ b
        m += w * n.T @ g @ n
    return k, m, phis


def axes(a: Array, b: Array) -> Array:
    """Rows: local x, y, z; local z as far up as it can be, of vertical members global -x."""
    ex = (b - a) / np.linalg.norm(b - a)
    if np.hypot(ex[0], ex[1]) < 1e-9:
        ez = np.array([-1.0, 0, 0])
        return np.array([ex, np.cross(ez, ex), ez])
    ey = np.cross([0.0, 0, 1], ex)
    ey /= np.linalg.norm(ey)
    return np.array([ex, ey, np.cross(ex, ey)])
