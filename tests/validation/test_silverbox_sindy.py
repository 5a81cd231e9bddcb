"""The free run of a polynomial model against scipy's, and terms as PySINDy writes them."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from validation.studies.silverbox_sindy import Found, Record, marched, off, powers_of, size

POWERS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [3, 0, 0]])
HARDENING = np.array([[0.0, 1.0, 0.0, 0.0], [-1.0, -0.1, 0.4, -0.3]])


def pushed(step: float = 0.02, points: int = 2001) -> tuple[np.ndarray, np.ndarray]:
    t = step * np.arange(points)
    half = np.interp(0.5 * np.arange(2 * points - 1), np.arange(points), np.sin(0.9 * t))
    return t, half


def test_a_free_run_is_that_of_scipy() -> None:
    t, half = pushed()

    def rate(now, s):
        y, v = s
        return v, -y - 0.1 * v + 0.4 * np.sin(0.9 * now) - 0.3 * y**3

    exact = solve_ivp(rate, (0.0, t[-1]), (0.2, -0.1), t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    own = marched(HARDENING, POWERS, half, 0.02, 0.2, -0.1)
    assert np.abs(own - exact).max() < 1e-4 * np.abs(exact).max()


def test_what_runs_away_is_infinitely_wrong() -> None:
    t, half = pushed()
    record = Record(0.0 * t, 0.0 * t, 0.0 * t, half[::2], half, 0.02, 1)
    softens = HARDENING * np.where(np.arange(4) == 3, -9.0, 1.0)
    assert size(off(Found(softens, POWERS, 0.0), record, True)) == np.inf
    assert np.isfinite(size(off(Found(HARDENING, POWERS, 0.0), record, True)))


def test_terms() -> None:
    assert powers_of("y") == (1, 0, 0) and powers_of("y^2 u") == (2, 0, 1)
    assert powers_of("y v u") == (1, 1, 1)
    assert Found(HARDENING, POWERS, 0.0).text == "-1.0000 y -0.1000 v +0.4000 u -0.3000 y^3"
