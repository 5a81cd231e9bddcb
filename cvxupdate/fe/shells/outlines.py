"""The square and the triangle that shell elements are mapped from: corners, sides, shape functions.

A side runs from corner to corner around the element. It carries a bubble (1 at its middle, 0 on the
other sides) and an edge function, whose component along the side is the only one there is on it
(Nédélec 1980; on the square the interpolation of Bathe and Dvorkin 1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.terms import Real

_SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_GRADIENTS = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])  # of the area coordinates


@dataclass(frozen=True)
class Sampled:
    """Functions at quadrature points q of the reference outline: ``weights`` (q,), ``N`` (q, n) and
    its gradient ``dN`` (q, 2, n), bubbles ``P`` (q, s) and ``dP`` (q, 2, s), edge functions ``E``
    (q, 2, s)."""

    weights: Real
    N: Real
    dN: Real
    P: Real
    dP: Real
    E: Real


def sides_of(corners: int) -> tuple[tuple[int, int], ...]:
    """First and second corner of each side, around the element."""
    return tuple((i, (i + 1) % corners) for i in range(corners))


def sampled(corners: int, degree: int) -> Sampled:
    """Functions at the points of a rule that is exact for polynomials of ``degree`` (1 to 5)."""
    points, weights = _triangle_rule(degree) if corners == 3 else _square_rule(degree)
    functions = _triangle if corners == 3 else _square
    at = [functions(*p) for p in points]
    return Sampled(weights, *(np.array(values) for values in zip(*at, strict=True)))


def _square_rule(degree: int) -> tuple[Real, Real]:
    x, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
    return np.array([(a, b) for a in x for b in x]), np.outer(w, w).ravel()


def _triangle_rule(degree: int) -> tuple[Real, Real]:
    """One, three or seven points (Radon 1948), of area 1/2."""
    if degree < 2:
        return np.full((1, 2), 1.0 / 3.0), np.array([0.5])
    if degree == 2:
        return np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]]) / 6.0, np.full(3, 1.0 / 6.0)
    root = np.sqrt(15.0)
    points, weights = [np.full((1, 2), 1.0 / 3.0)], [np.array([9.0 / 80.0])]
    for sign in (-1.0, 1.0):
        near = (6.0 + sign * root) / 21.0
        far = 1.0 - 2.0 * near
        points.append(np.array([[near, near], [far, near], [near, far]]))
        weights.append(np.full(3, (155.0 + sign * root) / 2400.0))
    return np.vstack(points), np.concatenate(weights)


def _square(x: float, y: float) -> tuple[Real, ...]:
    a, b = _SQUARE.T
    N = (1 + a * x) * (1 + b * y) / 4
    dN = np.array([a * (1 + b * y), b * (1 + a * x)]) / 4
    P = np.array(
        [(1 - x * x) * (1 - y), (1 + x) * (1 - y * y), (1 - x * x) * (1 + y), (1 - x) * (1 - y * y)]
    )
    dP = np.array(
        [
            [-2 * x * (1 - y), 1 - y * y, -2 * x * (1 + y), -(1 - y * y)],
            [-(1 - x * x), -2 * y * (1 + x), 1 - x * x, -2 * y * (1 - x)],
        ]
    )
    E = np.array([[1 - y, 0.0, -(1 + y), 0.0], [0.0, 1 + x, 0.0, -(1 - x)]]) / 4
    return N, dN, P / 2, dP / 2, E


def _triangle(x: float, y: float) -> tuple[Real, ...]:
    N = np.array([1 - x - y, x, y])
    i, j = np.array(sides_of(3)).T
    P = 4 * N[i] * N[j]
    dP = 4 * (N[i] * _GRADIENTS[:, j] + N[j] * _GRADIENTS[:, i])
    return N, _GRADIENTS.copy(), P, dP, N[i] * _GRADIENTS[:, j] - N[j] * _GRADIENTS[:, i]
