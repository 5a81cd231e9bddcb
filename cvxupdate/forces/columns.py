"""Forces per unit coefficient along a recorded motion: a residual force is r = Σ coefficient ·
column, and the coefficients follow from a linear regression (Masri and Caughey 1979, restoring
force surface; here with memory too).

x and v are (samples, places) in m (or rad) and per second; columns are (samples, places, grid).
What a law is not linear in (gaps, slip distances) is a grid. Laws with memory start without force
at the first sample.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cvxupdate.forces.laws import Laws, Real, bouc_wen, jenkins, join


def cubic_column(x: Real) -> Real:
    """x³, per k3 in N/m³: (samples, places, 1)."""
    return _alone(x**3)


def signed_square_column(x: Real) -> Real:
    """x|x|, per k2 in N/m²."""
    return _alone(x * np.abs(x))


def even_column(x: Real) -> Real:
    """x², per ``even`` in N/m²."""
    return _alone(x**2)


def quadratic_column(v: Real) -> Real:
    """|v|v, per c2 in N·s²/m²."""
    return _alone(np.abs(v) * v)


def friction_column(v: Real, smooth: float = 0.0) -> Real:
    """sgn(v) per N; with ``smooth`` (m/s) tanh(v / smooth), which noise at rest turns less."""
    return _alone(np.tanh(v / smooth) if smooth > 0.0 else np.sign(v))


def contact_columns(x: Real, gaps: ArrayLike, both: bool = False) -> Real:
    """How far x is beyond each of the ``gaps`` (m), per N/m; a signed gap says the side of contact,
    ``both`` makes it two-sided."""
    g = np.atleast_1d(np.asarray(gaps, dtype=float))
    at = np.asarray(x)[..., None]
    if both:
        return np.asarray(np.sign(at) * np.maximum(np.abs(at) - np.abs(g), 0.0))
    return np.asarray(np.where(np.signbit(g), np.minimum(at - g, 0.0), np.maximum(at - g, 0.0)))


def jenkins_columns(x: Real, slips: ArrayLike, play: ArrayLike = 0.0) -> Real:
    """Force of Jenkins elements per N of slip force, for every slip distance force/k (m): an Iwan
    distribution is their sum with non-negative coefficients. ``play`` (m, one or one for each slip)
    is the free play."""
    g = np.atleast_1d(np.asarray(slips, dtype=float))
    return _grid(x, jenkins(1.0 / g, 1.0, play))


def bouc_wen_columns(x: Real, slips: ArrayLike, n: float = 1.0, gamma: float = 0.5) -> Real:
    """The same for Bouc–Wen's law, per N of its limit."""
    g = np.atleast_1d(np.asarray(slips, dtype=float))
    return _grid(x, bouc_wen(1.0 / g, 1.0, n, gamma))


def _grid(x: Real, laws: Laws) -> Real:
    samples, places = np.shape(x)
    path = np.repeat(np.asarray(x, dtype=float), laws.size, axis=1)
    force, _ = join([laws] * places).trace(path, np.zeros_like(path))
    return np.asarray(force.reshape(samples, places, laws.size), dtype=float)


def _alone(column: Real) -> Real:
    return np.asarray(column, dtype=float)[..., None]
