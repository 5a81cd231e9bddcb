"""The modal model of an FRF and its derivatives, line by line.

``H_oi(w) = (i w)^q [ sum_r phi_or L_ri d_r(w) + conj(phi_or L_ri) e_r(w) + U_oi - W_oi / w² ]``

with q = 0, 1, 2 for receptance, mobility, accelerance (Ewins, *Modal Testing*, sections 2.4 to 2.8 and 4.4). Viscous
damping: ``d = 1 / (i w - p)``, ``e = 1 / (i w - conj p)``. Hysteretic damping: ``d = 1 / (l - w²)``, ``l = w_r² (1 +
i eta)``, ``e = 0``. U and W are the upper and lower residuals, real: the static part of modes above the band, the
inertia of those below.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import differentiator
from cvxupdate.recordings.types import Complex, Real

DAMPING = ("viscous", "hysteretic")


@dataclass(frozen=True)
class Roots:
    """What the modal model has once per mode: ``value`` (modes,) p or l; ``participation`` L (modes, inputs);
    ``damping``."""

    value: Complex
    participation: Complex
    damping: str = "viscous"


def check_damping(damping: str) -> None:
    """Raise `RecordingError` unless the damping model is one of `DAMPING`."""
    if damping not in DAMPING:
        raise RecordingError(f"damping model {damping!r} is not known; choose one of {', '.join(DAMPING)}")


def value_from_pole(pole: Complex, damping: str) -> Complex:
    """p itself, or ``l = |p|² (1 + 2 i zeta)`` for hysteretic damping (eta = 2 zeta at resonance)."""
    if damping == "viscous":
        return pole
    size = np.abs(pole)
    return np.asarray(size**2 * (1.0 - 2j * pole.real / size))


def frequency_and_damping(value: Complex, damping: str) -> tuple[Real, Real]:
    """Natural frequencies (Hz) and fractions of critical damping (eta / 2 when hysteretic), both (modes,)."""
    if damping == "viscous":
        size = np.abs(value)
        return np.asarray(size / (2.0 * np.pi)), np.asarray(-value.real / size)
    return np.asarray(np.sqrt(value.real) / (2.0 * np.pi)), np.asarray(0.5 * value.imag / value.real)


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
        rows = [[a / size / (2 * np.pi), b / size / (2 * np.pi)], [-(b**2) / size**3, a * b / size**3]]
    else:
        rows = [[0.25 / (np.pi * np.sqrt(a)), np.zeros_like(a)], [-0.5 * b / a**2, 0.5 / a]]
    return np.asarray(np.array(rows).transpose(2, 0, 1))


def terms(frequency: Real, value: Complex, damping: str) -> tuple[Complex, Complex, Complex, Complex]:
    """d, e, and their derivatives by value and by conj(value), each (lines, modes)."""
    if damping == "viscous":
        s = 2j * np.pi * frequency[:, None]
        d, e = np.asarray(1.0 / (s - value)), np.asarray(1.0 / (s - np.conj(value)), dtype=np.complex128)
        return d, e, d**2, np.asarray(e**2, dtype=np.complex128)
    d = 1.0 / (value - (2.0 * np.pi * frequency[:, None]) ** 2)
    zero = np.zeros_like(d)
    return d, zero, -(d**2), zero


def linear_basis(frequency: Real, roots: Roots, order: int, residuals: tuple[bool, bool]) -> Complex:
    """Columns that multiply Re phi, Im phi (mode by mode), then U per input, then W per input; (lines, inputs,
    columns).

    ``order`` is q of the module's formula; ``residuals`` says whether (lower, upper) are there.
    """
    lines, inputs = frequency.size, roots.participation.shape[1]
    g = differentiator(frequency, order)
    d, e, _, _ = terms(frequency, roots.value, roots.damping)
    L = roots.participation.T
    U = (g[:, None] * d)[:, None, :] * L
    V = (g[:, None] * e)[:, None, :] * np.conj(L)
    parts = [U + V, 1j * (U - V)]
    eye = np.broadcast_to(np.eye(inputs), (lines, inputs, inputs))
    lower, upper = residuals
    if upper:
        parts.append(g[:, None, None] * eye)
    if lower:
        parts.append(-(g / (2.0 * np.pi * frequency) ** 2)[:, None, None] * eye)
    return np.concatenate(parts, axis=2)


def root_columns(
    d_all: tuple[Complex, Complex, Complex, Complex], g: Complex, roots: Roots, phi: Complex, free: Real
) -> Complex:
    """Derivatives of one output's FRFs by Re and Im of the roots, then of the free participations; (lines, inputs,
    columns).

    ``phi`` (modes,) is the output's row of shapes; ``free`` (modes, inputs) is True where L may vary.
    """
    d, e, dd, ee = d_all
    L = roots.participation.T
    left = (g[:, None] * dd * phi)[:, None, :] * L
    right = (g[:, None] * ee * np.conj(phi))[:, None, :] * np.conj(L)
    modes, inputs = np.nonzero(free)
    a = g[:, None] * d[:, modes] * phi[modes]
    b = g[:, None] * e[:, modes] * np.conj(phi[modes])
    place = np.zeros((roots.participation.shape[1], modes.size))
    place[inputs, np.arange(modes.size)] = 1.0
    return np.concatenate(
        [left + right, 1j * (left - right), (a + b)[:, None, :] * place, (1j * (a - b))[:, None, :] * place], axis=2
    )


def pinned(participation: Complex) -> tuple[Complex, Real]:
    """Participations scaled to 1 at each mode's largest entry, and the (modes, inputs) mask of the entries left
    free."""
    largest = np.argmax(np.abs(participation), axis=1)
    rows = np.arange(participation.shape[0])
    scaled = participation / participation[rows, largest][:, None]
    free = np.ones(participation.shape, dtype=bool)
    free[rows, largest] = False
    return scaled, np.asarray(free)


def real_imag(columns: Complex) -> Real:
    """(lines, inputs, columns) complex to (2 lines inputs, columns) real."""
    flat = columns.reshape(-1, columns.shape[-1])
    return np.concatenate([flat.real, flat.imag])
