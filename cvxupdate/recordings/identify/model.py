"""The modal model of an FRF and its derivatives, line by line.

``H_oi(w) = (i w)^q [ sum_r phi_or L_ri d_r(w) + conj(phi_or L_ri) e_r(w) +
sum_k U_koi (w/w1)^2k - sum_k W_koi w^-2 (w0/w)^2k ]``

with q = 0, 1, 2 for receptance, mobility, accelerance (Ewins, *Modal Testing*, sections 2.4 to 2.8
and 4.4). Viscous damping: ``d = 1 / (i w - p)``, ``e = 1 / (i w - conj p)``. Hysteretic damping:
``d = 1 / (l - w²)``, ``l = w_r² (1 + i eta)``, ``e = 0``. U and W (k = 0, 1, ...) are the upper and
lower residuals, real: the static part of the modes above the band and the inertia of those below,
with as many terms of their expansions in frequency as asked for; w0 and w1 are the ends of the
band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import differentiator
from cvxupdate.recordings.types import Complex, Real

IntArray = NDArray[np.int64]
DAMPING = ("viscous", "hysteretic")


@dataclass(frozen=True)
class Roots:
    """What the modal model has once per mode: ``value`` (modes,) p or l; ``participation`` L
    (modes, inputs); ``damping``."""

    value: Complex
    participation: Complex
    damping: str = "viscous"


def check_damping(damping: str) -> None:
    """Raise `RecordingError` unless the damping model is one of `DAMPING`."""
    if damping not in DAMPING:
        raise RecordingError(
            f"unknown damping model {damping!r}; choose one of {', '.join(DAMPING)}"
        )


def value_from_pole(pole: Complex, damping: str) -> Complex:
    """p itself, or ``l = |p|² (1 + 2 i zeta)`` for hysteretic damping (eta = 2 zeta at
    resonance)."""
    if damping == "viscous":
        return pole
    size = np.abs(pole)
    return np.asarray(size**2 * (1.0 - 2j * pole.real / size))


def frequency_and_damping(value: Complex, damping: str) -> tuple[Real, Real]:
    """Natural frequencies (Hz) and fractions of critical damping (eta / 2 when hysteretic), both
    (modes,)."""
    if damping == "viscous":
        size = np.abs(value)
        return np.asarray(size / (2.0 * np.pi)), np.asarray(-value.real / size)
    return np.asarray(np.sqrt(value.real) / (2.0 * np.pi)), np.asarray(
        0.5 * value.imag / value.real
    )


def pole_from_value(value: Complex, damping: str) -> Complex:
    """The viscous pole (rad/s) with the same natural frequency and fraction of critical damping."""
    if damping == "viscous":
        return value
    f, zeta = frequency_and_damping(value, damping)
    return np.asarray(2.0 * np.pi * f * (-zeta + 1j * np.sqrt(1.0 - zeta**2)))


def frequency_damping_gradient(value: Complex, damping: str) -> Real:
    """d(frequency Hz, fraction of critical) / d(Re value, Im value), (modes, 2, 2)."""
    a, b = value.real, value.imag
    if damping == "viscous":
        size = np.abs(value)
        rows = [
            [a / size / (2 * np.pi), b / size / (2 * np.pi)],
            [-(b**2) / size**3, a * b / size**3],
        ]
    else:
        rows = [[0.25 / (np.pi * np.sqrt(a)), np.zeros_like(a)], [-0.5 * b / a**2, 0.5 / a]]
    return np.asarray(np.array(rows).transpose(2, 0, 1))


def terms(
    frequency: Real, value: Complex, damping: str
) -> tuple[Complex, Complex, Complex, Complex]:
    """d, e, and their derivatives by value and by conj(value), each (lines, modes)."""
    if damping == "viscous":
        s = 2j * np.pi * frequency[:, None]
        d, e = (
            np.asarray(1.0 / (s - value)),
            np.asarray(1.0 / (s - np.conj(value)), dtype=np.complex128),
        )
        return d, e, d**2, np.asarray(e**2, dtype=np.complex128)
    d = 1.0 / (value - (2.0 * np.pi * frequency[:, None]) ** 2)
    zero = np.zeros_like(d)
    return d, zero, -(d**2), zero


def residual_terms(frequency: Real, band: tuple[float, float], residuals: tuple[int, int]) -> Real:
    """The residual functions, upper then lower, as real columns: (lines, residuals[1] +
    residuals[0])."""
    lower, upper = residuals
    columns = [(frequency / band[1]) ** (2 * k) for k in range(upper)]
    columns += [
        -((2.0 * np.pi * frequency) ** -2) * (band[0] / frequency) ** (2 * k) for k in range(lower)
    ]
    return np.stack(columns, axis=1) if columns else np.zeros((frequency.size, 0))


def linear_basis(
    frequency: Real, roots: Roots, order: int, residuals: tuple[int, int], band: tuple[float, float]
) -> Complex:
    """Columns that multiply Re phi, Im phi (mode by mode), then U, then W, term by term; (lines,
    inputs, columns).

    ``order`` is q of the module's formula; ``residuals`` the number of (lower, upper) terms;
    ``band`` its (w0, w1) / 2 pi.
    """
    lines, inputs = frequency.size, roots.participation.shape[1]
    g = differentiator(frequency, order)
    d, e, _, _ = terms(frequency, roots.value, roots.damping)
    L = roots.participation.T
    U = (g[:, None] * d)[:, None, :] * L
    V = (g[:, None] * e)[:, None, :] * np.conj(L)
    parts = [U + V, 1j * (U - V)]
    eye = np.broadcast_to(np.eye(inputs), (lines, inputs, inputs))
    parts += [
        (g * column)[:, None, None] * eye for column in residual_terms(frequency, band, residuals).T
    ]
    return np.concatenate(parts, axis=2)


def root_dictionary(
    frequency: Real, roots: Roots, order: int, free: NDArray[np.bool_]
) -> tuple[Real, Real, IntArray]:
    """What the derivatives by the roots are made of, real and imaginary parts stacked as in
    `real_imag`.

    X, Y (2 lines inputs, columns) and the mode of each column: the roots first, then the free
    participations. For an output with shape entries phi the derivative by the real part of a root
    is ``Re phi X + Im phi Y``, by its imaginary part ``Re phi Y - Im phi X``. ``free`` (modes,
    inputs) is True where L may vary.
    """
    d, e, dd, ee = terms(frequency, roots.value, roots.damping)
    g = differentiator(frequency, order)[:, None]
    L = roots.participation.T
    left, right = (g * dd)[:, None, :] * L, (g * ee)[:, None, :] * np.conj(L)
    modes, inputs = np.nonzero(free)
    place = np.zeros((L.shape[0], modes.size))
    place[inputs, np.arange(modes.size)] = 1.0
    a, b = (g * d)[:, None, modes] * place, (g * e)[:, None, modes] * place
    X = np.concatenate([left + right, a + b], axis=2)
    Y = np.concatenate([1j * (left - right), 1j * (a - b)], axis=2)
    return real_imag(X), real_imag(Y), np.concatenate([np.arange(roots.value.size), modes])


def pinned(participation: Complex) -> tuple[Complex, NDArray[np.bool_]]:
    """Participations scaled to 1 at each mode's largest entry, and the (modes, inputs) mask of the
    entries left free."""
    largest = np.argmax(np.abs(participation), axis=1)
    rows = np.arange(participation.shape[0])
    scaled = participation / participation[rows, largest][:, None]
    free = np.ones(participation.shape, dtype=bool)
    free[rows, largest] = False
    return scaled, free


def real_imag(columns: Complex) -> Real:
    """(lines, inputs, columns) complex to (2 lines inputs, columns) real."""
    flat = columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])
    return np.concatenate([flat.real, flat.imag])
