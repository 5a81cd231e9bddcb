"""Beam shape functions and their integrals, on the unit interval.

Interdependent interpolation of a Timoshenko beam (Friedman and Kosmatka 1993, eqs. 11-12): with Φ =
12 E I / (κ G A L²) every shape function is (cubic + Φ · linear or quadratic) / (1 + Φ); Φ = 0 gives
the cubic Hermite functions of Euler and Bernoulli. The DOFs are (w₁, ψ₁, w₂, ψ₂) with ψ = dw/dξ at
Φ = 0.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import polynomial as P

from cvxupdate.fe.terms import Real

# Ascending powers of ξ: the part without Φ and the part that Φ multiplies, for w(ξ) and ψ(ξ).
_W = (
    np.array([[1.0, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]]),
    np.array([[1.0, -1, 0, 0], [0, 0.5, -0.5, 0], [0, 1, 0, 0], [0, -0.5, 0.5, 0]]),
)
_PSI = (
    np.array([[0.0, -6, 6], [1, -4, 3], [0, 6, -6], [0, -2, 3]]),
    np.array([[0.0, 0, 0], [1, -1, 0], [0, 0, 0], [0, 1, 0]]),
)


def _gram(a: Real, b: Real) -> Real:
    """∫₀¹ aᵢ bⱼ dξ of two sets of polynomials."""
    out = np.empty((len(a), len(b)))
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            r = P.polyint(P.polymul(p, q))
            out[i, j] = P.polyval(1.0, r) - r[0]
    return out


def _derivative(a: Real) -> Real:
    return np.array([P.polyder(p) for p in a])


@lru_cache(maxsize=1)
def unit_matrices() -> dict[str, Real]:
    """Unit-length 4 × 4 factors.

    Keys: ``K0``, ``K1`` (bending: (K0 + Φ K1) / (1 + Φ)), ``M0..M2`` (translation), ``R0..R2``
    (rotary inertia), ``G0..G2`` (geometric stiffness, ∫w'w'), each of the last three summed with
    powers of Φ over (1 + Φ)².
    """
    out: dict[str, Real] = {}
    for key, (a0, a1) in {
        "M": _W,
        "R": _PSI,
        "G": (_derivative(_W[0]), _derivative(_W[1])),
    }.items():
        cross = _gram(a0, a1)
        out[key + "0"], out[key + "1"], out[key + "2"] = (
            _gram(a0, a0),
            cross + cross.T,
            _gram(a1, a1),
        )
    curvature = _derivative(_PSI[0])
    out["K0"] = _gram(curvature, curvature)
    out["K1"] = np.array([[0.0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 0, 0], [0, -1, 0, 1]])
    return out
