"""Exact dynamic stiffness of one prismatic member: tension, torsion and bending with shear, rotary
inertia and axial preload (thesis 8.11 to 8.17, A.3).

A member of length 2h is split into its motion symmetric and antisymmetric about its middle. Then
the 12 × 12 matrix of (8.15) is a sum of sixteen scalars times fixed patterns, and each scalar is a
rational function of `half.pair`: no δ of (8.16), whose cosh and cos cancel, no wave number that
turns imaginary above √(κGA/ρI), no 0/0 as ω → 0. Derived from

    B ψ'' + S (w' − ψ) − r ψ = 0        (S (w' − ψ) + N w')' − μ w = 0

with S = κGA = 1/σ (σ = 0: Euler–Bernoulli or Rayleigh), inertias μ = s² ρA, r = s² ρI, s = iω for a
frequency response: w ~ exp(λx) where (1 + Nσ) B λ⁴ − (μBσ + (1 + Nσ) r + N) λ² + μ (1 + rσ) = 0.
Timoshenko's equation (8.12) is N = 0, Rayleigh's (8.11) σ = 0. The derivatives are A.3's chain rule
in these variables: from the properties to the coefficients of the characteristic equation, from
them to the functions of its roots, from those to the stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.exact.half import pair, tau, tau_slope

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Both = tuple[Complex, Complex]
"""A value and its derivative along one change of the properties."""


@dataclass(frozen=True)
class Bending:
    """What bending in one plane is made of, each (members,): ``B`` = EI, ``flexible`` σ = 1/κGA,
    ``N``, ``mass`` μ = s² ρA and ``rotary`` r = s² ρI."""

    B: Any
    flexible: Any
    N: Any
    mass: Any
    rotary: Any


def bar(stiffness: Any, mass: Any, h: Any, d_stiffness: Any, d_mass: Any) -> tuple[Both, Both]:
    """Tension or torsion, EA u'' = s² ρA u on half length h: (symmetric, antisymmetric) end force
    for a unit motion of either end; G₁ and G₂ of (8.16) are their half sum and half difference.

    ``d_stiffness`` and ``d_mass`` are changes of EA and s² ρA; each part comes with its change.
    """
    z = mass * h**2 / stiffness
    dz = d_mass * h**2 / stiffness - z * d_stiffness / stiffness
    t = tau(z)
    slope = tau_slope(z, t) * dz
    symmetric = (mass * h * t, d_mass * h * t + mass * h * slope)
    value = stiffness / (h * t)
    return symmetric, (value, d_stiffness / (h * t) - value * slope / t)


def bending(m: Bending, h: Any, change: Bending) -> tuple[Both, ...]:
    """(symmetric 11, 12, 22, antisymmetric 11, 12, 22), each with its change, of the forces and
    moments at x = +h for w and ψ there.

    ``change`` holds the changes of the five properties. Static limits: 3EI/h³ of the cantilever of
    half length in the antisymmetric 11, EI/h of constant bending in the symmetric 22.
    """
    B, o, N, u, r = m.B, m.flexible, m.N, m.mass, m.rotary
    dB, do, dN, du, dr = change.B, change.flexible, change.N, change.mass, change.rotary
    p, dp = 1.0 + N * o, dN * o + N * do
    f, df = 1.0 + r * o, dr * o + r * do
    # z² − e₁ z + e₂ = 0 for z = (λh)²
    sum_ = u * B * o + p * r + N
    d_sum = du * B * o + u * dB * o + u * B * do + dp * r + p * dr + dN
    a, da = p * B, dp * B + p * dB
    e1, de1 = sum_ * h**2 / a, (d_sum - sum_ * da / a) * h**2 / a
    last, d_last = u * f, du * f + u * df
    e2, de2 = last * h**4 / a, (d_last - last * da / a) * h**4 / a
    q = pair(e1, e2)
    (d1, d2), (m1, m2), (p1, p2) = q.slopes
    T, dT = h**3 * q.difference, h**3 * (d1 * de1 + d2 * de2)  # divided difference of T = h τ
    U, dU = h * q.moment, h * (m1 * de1 + m2 * de2)  # that of λ² T
    P, dP = h**2 * q.product, h**2 * (p1 * de1 + p2 * de2)
    low = p * U - u * o * T
    d_low = dp * U + p * dU - du * o * T - u * do * T - u * o * dT
    high = f * T / B - o * U
    d_high = (df * T + f * dT - f * T * dB / B) / B - do * U - o * dU
    tops = (
        (u * P * p, du * P * p + u * dP * p + u * P * dp, low, d_low),
        (u * T, du * T + u * dT, low, d_low),
        (B * p, dB * p + B * dp, low, d_low),
        (-p, -dp, high, d_high),
        (U, dU, high, d_high),
        (-f * P, -df * P - f * dP, high, d_high),
    )
    return tuple((top / under, (d - top / under * d_) / under) for top, d, under, d_ in tops)


def sines(z: Any) -> Index:
    """How many half waves of a member with z = (λh)² at both ends still: n π < 2 √−z."""
    return np.floor(2.0 / np.pi * np.sqrt(np.maximum(-np.real(z), 0.0))).astype(np.int64)


def supported_below(m: Bending, h: Any) -> Index:
    """How many natural frequencies of a simply supported member lie below that of ``m``'s inertias,
    (members,): its modes are sines, n π / 2h = √−λ² on either branch, and the thickness shear that
    needs no wave (Timoshenko, above √(κGA/ρI))."""
    p, f = 1.0 + m.N * m.flexible, 1.0 + m.rotary * m.flexible
    a = p * m.B
    e1 = np.asarray((m.mass * m.B * m.flexible + p * m.rotary + m.N) * h**2 / a)
    e2 = np.asarray(m.mass * f * h**4 / a)
    root = np.sqrt(np.maximum(e1**2 - 4.0 * e2, 0.0))
    larger = (e1 + np.where(e1 < 0.0, -root, root)) / 2.0
    other = np.where(larger == 0.0, 0.0, e2 / np.where(larger == 0.0, 1.0, larger))
    return np.asarray(sines(larger) + sines(other) + (np.asarray(f) < 0.0))
