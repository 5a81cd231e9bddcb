"""Membrane stiffness with drilling rotations, on the DOFs (u, v, θz) of every corner.

Triangle: the optimal element of Felippa (2003, "A study of optimal membrane triangles with drilling
freedoms", α = 3/2): a basic stiffness that constant stress fixes, and one of higher order against
what the drilling rotations have beyond the mean rotation of the sheet. Neither resists a rigid-body
motion, and no drilling stiffness is added. Its β₀ = ½ (1 − 4 ν²), taken at ν = 0.3, weighs the
higher order only: in-plane bending of a rectangle is then exact at any aspect ratio.

Quadrilateral: the mean of its two divisions into two triangles each, so that neither diagonal is
preferred.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.shells.bending import quadratic
from cvxupdate.fe.terms import Real

_BETA = ((1.0, 2.0, 1.0), (0.0, 1.0, -1.0), (-1.0, -1.0, -2.0))
_ORDERS = ((1, 2, 3, 4, 5, 6, 7, 8, 9), (9, 7, 8, 3, 1, 2, 6, 4, 5), (5, 6, 4, 8, 9, 7, 2, 3, 1))
_HIGHER = 0.5 * (1.0 - 4.0 * 0.3**2)
_HALVES = ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))

Differences = dict[tuple[int, int], Real]


def membrane_terms(plane: Real) -> dict[str, Real]:
    """Factors ``Ax``, ``Ay``, ``A1``, ``Axy``, (e, 3 n, 3 n)."""
    if plane.shape[1] == 3:
        return {f"A{key}": values for key, values in _triangle(plane).items()}
    out: dict[str, Real] = {}
    for corners in _HALVES:
        places = [3 * c + i for c in corners for i in range(3)]
        for key, values in _triangle(plane[:, corners]).items():
            whole = out.setdefault(f"A{key}", np.zeros((len(plane), 12, 12)))
            whole[np.ix_(range(len(plane)), places, places)] += 0.5 * values
    return out


def _triangle(plane: Real) -> dict[str, Real]:
    x, y = (
        {(i, j): plane[:, i, k] - plane[:, j, k] for i in range(3) for j in range(3)}
        for k in range(2)
    )
    area = (x[1, 0] * y[2, 0] - x[2, 0] * y[1, 0]) / 2.0
    strains = np.stack([_basic(x, y, area), *_higher(x, y, area)])
    weights = np.array([1.0, *(0.75 * _HIGHER,) * 3])[:, None] * area
    return quadratic(strains, strains, weights)


def _basic(x: Differences, y: Differences, area: Real) -> Real:
    """Mean strains (e, 3, 9): the forces of constant stress at the corners, over the volume."""
    out = np.zeros((len(area), 3, 9))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[:, 0, 3 * i], out[:, 1, 3 * i + 1] = y[j, k], x[k, j]
        out[:, 2, 3 * i], out[:, 2, 3 * i + 1] = x[k, j], y[j, k]
        out[:, 0, 3 * i + 2] = y[j, k] * (y[i, k] - y[j, i]) / 4.0
        out[:, 1, 3 * i + 2] = x[k, j] * (x[k, i] - x[i, j]) / 4.0
        out[:, 2, 3 * i + 2] = (x[k, i] * y[i, k] - x[i, j] * y[j, i]) / 2.0
    return out / (2.0 * area[:, None, None])


def _higher(x: Differences, y: Differences, area: Real) -> list[Real]:
    """Strains (e, 3, 9) at the middle of each side from what the drilling rotations have beyond the
    mean rotation of the sheet."""
    e = len(area)
    squares = np.stack([x[s] ** 2 + y[s] ** 2 for s in ((1, 0), (2, 1), (0, 2))], axis=1)
    deviation = np.zeros((e, 3, 9))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        deviation[:, :, 3 * i] = (x[k, j] / (4.0 * area))[:, None]
        deviation[:, :, 3 * i + 1] = (y[k, j] / (4.0 * area))[:, None]
        deviation[:, i, 3 * i + 2] = 1.0
    cartesian = np.zeros((e, 3, 3))
    for c, ((i, j), (k, m)) in enumerate((((1, 2), (0, 2)), ((2, 0), (1, 0)), ((0, 1), (2, 1)))):
        cartesian[:, 0, c] = y[i, j] * y[k, m]
        cartesian[:, 1, c] = x[i, j] * x[k, m]
        cartesian[:, 2, c] = y[i, j] * x[m, k] + x[j, i] * y[k, m]
    cartesian *= squares[:, None, :] / (4.0 * area**2)[:, None, None]
    scale = (2.0 * area[:, None] / 3.0) / squares
    beta = np.array(_BETA).ravel()
    corner = [scale[:, :, None] * beta[np.array(o) - 1].reshape(3, 3) for o in _ORDERS]
    middles = [(corner[a] + corner[b]) / 2.0 for a, b in ((0, 1), (1, 2), (2, 0))]
    return [np.asarray(cartesian @ m @ deviation) for m in middles]
