"""The functions of which every exact member is made: T = tanh(√z)/√z of its half length, and what
is symmetric in two of them.

Written in z = (λh)² and halves, an exact dynamic stiffness needs no cosh and sinh that cancel, no
case distinction where a wave number turns imaginary, and no division by the frequency: τ(z) =
tanh(√z)/√z is one meromorphic function for real, imaginary and complex √z, and below `SMALL` its
power series takes over.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import comb, factorial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

SMALL: Final = 0.3
"""|z| of both roots below which the series is used: there the derivatives lose some 1e-13."""
TERMS: Final = 20
"""Of the series: its radius of convergence is (π/2)², so the last is below 1e-18."""


def _bernoulli(count: int) -> list[Fraction]:
    """B₀, B₁, …, exactly, by Σ C(m + 1, k) B_k = 0."""
    out = [Fraction(1)]
    for m in range(1, count):
        out.append(-sum((comb(m + 1, k) * out[k] for k in range(m)), Fraction(0)) / (m + 1))
    return out


_B = _bernoulli(2 * TERMS + 5)
SERIES: Final = tuple(
    float(2 ** (2 * n) * (2 ** (2 * n) - 1) * _B[2 * n] / factorial(2 * n))
    for n in range(1, TERMS + 3)
)
"""tanh(x)/x = Σ SERIES[k] x^(2k) (Abramowitz and Stegun 4.5.64)."""


def tau(z: Any) -> Complex:
    """tanh(√z)/√z, for complex z."""
    z = np.asarray(z, dtype=complex)
    small = np.abs(z) < SMALL
    root = np.sqrt(np.where(small, 1.0, z))
    out = np.tanh(root) / root
    series = np.zeros_like(z)
    for c in reversed(SERIES):
        series = series * z + c
    return np.asarray(np.where(small, series, out))


def tau_slope(z: Any, value: Complex) -> Complex:
    """dτ/dz where τ(z) = ``value``: τ' = (1 − τ − z τ²) / 2z."""
    z = np.asarray(z, dtype=complex)
    small = np.abs(z) < SMALL
    safe = np.where(small, 1.0, z)
    out = (1.0 - value - z * value**2) / (2.0 * safe)
    series = np.zeros_like(z)
    for k in range(len(SERIES) - 1, 0, -1):
        series = series * z + k * SERIES[k]
    return np.asarray(np.where(small, series, out))


@dataclass(frozen=True)
class Pair:
    """Of the roots z₁, z₂ of z² − e₁ z + e₂: ``difference`` (τ₁ − τ₂)/(z₁ − z₂), ``moment`` that of
    z τ, ``product`` τ₁ τ₂; each with its derivatives to e₁ and e₂."""

    difference: Complex
    moment: Complex
    product: Complex
    slopes: tuple[tuple[Complex, Complex], ...]


def pair(e1: Any, e2: Any) -> Pair:
    """`Pair` for arrays e₁, e₂."""
    e1, e2 = np.broadcast_arrays(np.asarray(e1, dtype=complex), np.asarray(e2, dtype=complex))
    root = np.sqrt(e1**2 - 4.0 * e2)
    root = np.where(np.real(np.conj(e1) * root) < 0.0, -root, root)
    first = (e1 + root) / 2.0  # the larger root, so that the other is had without cancellation
    second = np.where(first == 0.0, 0.0, e2 / np.where(first == 0.0, 1.0, first))
    small = np.abs(first) < SMALL
    near, far = _near(e1[small], e2[small]), _far(first[~small], second[~small])
    out = [np.zeros(e1.shape, dtype=complex) for _ in range(9)]
    for whole, a, b in zip(out, near, far, strict=True):
        whole[small], whole[~small] = a, b
    return Pair(out[0], out[1], out[2], tuple((out[3 + 2 * k], out[4 + 2 * k]) for k in range(3)))


def _far(z1: Complex, z2: Complex) -> list[Complex]:
    """Values and derivatives from the functions themselves."""
    t1, t2 = tau(z1), tau(z2)
    d1, d2 = tau_slope(z1, t1), tau_slope(z2, t2)
    gap = z1 - z2
    difference = (t1 - t2) / gap
    moment = t1 + z2 * difference
    out = [difference, moment, t1 * t2]
    # dz_i = ±(z_i de₁ − de₂)/(z₁ − z₂)
    for change1, change2 in ((z1 / gap, -z2 / gap), (-1.0 / gap, 1.0 / gap)):
        turn = (d1 * change1 - d2 * change2 - difference * (change1 - change2)) / gap
        push = d1 * change1 + change2 * difference + z2 * turn
        out += [turn, push, d1 * change1 * t2 + t1 * d2 * change2]
    return [*out[:3], out[3], out[6], out[4], out[7], out[5], out[8]]


def _near(e1: Complex, e2: Complex) -> list[Complex]:
    """The same by power series in e₁, e₂: complete homogeneous polynomials h_n = Σ z₁^i z₂^(n−i)
    and power sums s_n of the two roots, by the one recursion that both obey."""
    one, none = np.ones_like(e1), np.zeros_like(e1)
    h, s = (
        _recursion(e1, e2, (one, e1), (none, one)),
        _recursion(e1, e2, (2.0 * one, e1), (none, one)),
    )
    out = [_AFTER @ h[0], _FIRST @ h[0]]
    power = np.cumprod([one, *[e2] * (len(_PRODUCT) - 1)], axis=0)
    inner = [_PRODUCT @ x for x in s]
    inner[0] = inner[0] + _SQUARES[:, None]
    j = np.arange(1, len(_PRODUCT))[:, None]
    out.append(np.sum(power * inner[0], axis=0))
    out += [_AFTER @ h[1], _AFTER @ h[2], _FIRST @ h[1], _FIRST @ h[2]]
    out.append(np.sum(power * inner[1], axis=0))
    out.append(np.sum(power * inner[2], axis=0) + np.sum(j * power[:-1] * inner[0][1:], axis=0))
    return out


def _recursion(
    e1: Complex, e2: Complex, first: tuple[Complex, Complex], slope: tuple[Complex, Complex]
) -> tuple[Complex, Complex, Complex]:
    """x_n = e₁ x_(n−1) − e₂ x_(n−2), and its derivatives to e₁ (which begin with ``slope``) and e₂,
    each (TERMS, …)."""
    x, a, b = list(first), list(slope), [np.zeros_like(e1)] * 2
    for _ in range(2, TERMS):
        a.append(x[-1] + e1 * a[-1] - e2 * a[-2])
        b.append(e1 * b[-1] - x[-2] - e2 * b[-2])
        x.append(e1 * x[-1] - e2 * x[-2])
    return np.array(x), np.array(a), np.array(b)


_FIRST: Final = np.array(SERIES[:TERMS])
_AFTER: Final = np.array(SERIES[1 : TERMS + 1])
_SQUARES: Final = np.array(SERIES[: TERMS // 2]) ** 2
_PRODUCT: Final = np.array(
    [
        [SERIES[j] * SERIES[j + n] if 0 < n < TERMS - j else 0.0 for n in range(TERMS)]
        for j in range(TERMS // 2)
    ]
)
"""τ₁ τ₂ = Σ_j e₂^j (c_j² + Σ_n c_j c_(j+n) s_n)."""
