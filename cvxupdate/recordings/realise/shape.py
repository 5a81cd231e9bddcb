"""Real modes from complex ones, shape by shape or set by set. ``shapes`` is (modes, channels); so
is every result."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.types import Complex, Real


def simple(shapes: Complex) -> Real:
    """Modulus with the sign of the cosine of the phase (2.16), after the phase of each shape
    was turned to its axis.

    Assumes light damping: phases close to 0 and 180 degrees. An entry near 90 degrees keeps its
    full modulus and a chance sign.
    """
    z = rotated(shapes)
    return np.asarray(np.where(z.real < 0.0, -1.0, 1.0) * np.abs(z))


def ahmadian_gladwell(shapes: Complex) -> Real:
    """The real part of the properly rotated shape (Ahmadian & Gladwell 1995): of all real vectors
    the one of largest MAC.

    Assumes nothing about the damping, and so cannot undo it: for heavy non-proportional damping the
    best correlated real vector is not the normal mode (after 2.34).
    """
    return np.asarray(rotated(shapes).real)


def niedbal(shapes: Complex) -> Real:
    """``Re + Im (Re^T Re)^-1 Re^T Im`` over all modes together (2.34; Niedbal 1984).

    Assumes that the real modes are ``phi_C T`` with Re T near the unit matrix: the measured modes
    span the real ones, phases were normalised (done here by `rotated`), and damping is light to
    moderate.

    Raises
    ------
    RecordingError
        When there are more modes than channels, or their real parts are dependent.
    """
    z = rotated(shapes).T
    if z.shape[1] > z.shape[0] or np.linalg.matrix_rank(z.real) < z.shape[1]:
        raise RecordingError(
            f"Niedbal's transformation needs independent shapes: {z.shape[1]} modes, "
            f"{z.shape[0]} channels; use fewer modes or more channels"
        )
    projected = np.linalg.lstsq(z.real, z.imag, rcond=None)[0]
    return np.asarray((z.real + z.imag @ projected).T)


def mac_with(complex_shape: Complex, real_shape: Real) -> float:
    """MAC of a complex and a real vector, both (channels,)."""
    top = float(np.abs(np.vdot(complex_shape, real_shape)) ** 2)
    return top / (
        float(np.vdot(complex_shape, complex_shape).real) * float(real_shape @ real_shape)
    )


def _best_step(c: Complex, r: Real, gamma: Real) -> float:
    """Root kappa of the quadratic of section 2.3.1 that maximises MAC(c, r + kappa gamma)."""
    a, b = np.vdot(c, r), np.vdot(c, gamma)
    A, B, C = abs(a) ** 2, 2.0 * float((a * np.conj(b)).real), abs(b) ** 2
    D, E, F = float(r @ r), 2.0 * float(r @ gamma), float(gamma @ gamma)
    roots = np.roots([C * E - B * F, 2.0 * (C * D - A * F), B * D - A * E])
    real = [0.0, *(float(k.real) for k in roots if abs(k.imag) <= 1e-9 * (1.0 + abs(k)))]
    value = [(A + B * k + C * k**2) / max(D + E * k + F * k**2, 1e-300) for k in real]
    return real[int(np.argmax(value))]


def imregun_ewins(shapes: Complex, start: Real | None = None, *, sweeps: int = 50) -> Real:
    """Real shapes of largest MAC with the complex ones, reached by ``phi_R + kappa gamma`` (Imregun
    & Ewins 1993).

    ``start`` (modes, channels), default `simple`. gamma runs over the real and imaginary parts of
    the complex shape and the unit vectors; kappa is a root of ``(CE - BF) k² + 2 (CD - AF) k + (BD
    - AE) = 0`` (section 2.3.1). Sweeps end when MAC gains nothing. Assumes that correlation is the
    measure of success; the maximum is the vector of `ahmadian_gladwell`, damping is not undone.
    """
    first = simple(shapes) if start is None else start
    result = np.array(first, dtype=np.float64)
    for m, c in enumerate(shapes):
        r = result[m]
        best = mac_with(c, r)
        for _ in range(sweeps):
            for gamma in (c.real, c.imag, *np.eye(c.size)):
                if float(gamma @ gamma) > 0.0:
                    r = r + _best_step(c, r, gamma) * gamma
            now = mac_with(c, r)
            if now - best < 1e-14:
                break
            best = now
        result[m] = r
    return result
