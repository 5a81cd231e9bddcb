"""Generated non-linear structures: their integrator against scipy's Radau."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation.nonlinear import LAWS, Truth, law, responses

SIZES = {
    "cubic_stiffness": {"k3": 4e9},
    "clearance": {"k": 3e4, "gap": 8e-4, "two": 1.0},
    "dry_friction": {"force": 3.0, "slow": 1e-3},
    "hysteresis": {"k": 3e4, "force": 8.0},
    "quadratic_damping": {"c2": 900.0},
}


@pytest.mark.parametrize("physics", LAWS)
def test_runge_and_kutta_agree_with_radau(physics: str) -> None:
    K, M = np.array([[9e4, -5e4], [-5e4, 5e4]]), np.diag([3.0, 2.0])
    zeta, rate, t = np.array([0.02, 0.03]), 400.0, np.arange(160) / 400.0
    force = 60.0 * np.sin(2.0 * np.pi * 14.0 * t) * np.minimum(1.0, 8.0 * t)
    truth = Truth(physics, (0, 1), SIZES[physics])
    a, x, _ = responses(K, M, zeta, truth, 1, force, rate, (0.0, 0.0), 2)
    lam, phi = np.linalg.eigh(np.linalg.inv(np.sqrt(M)) @ K @ np.linalg.inv(np.sqrt(M)))
    phi = np.linalg.inv(np.sqrt(M)) @ phi
    C = M @ phi @ np.diag(2.0 * zeta * np.sqrt(lam)) @ phi.T @ M
    sizes = np.array([*truth.sizes.values(), 0.0, 0.0, 0.0])[:3]
    kind = LAWS.index(physics) + 1
    many = np.fft.irfft(np.append(np.fft.rfft(force), np.zeros(80 * 15)), 160 * 16) * 16
    fine = np.arange(len(many)) / (16 * rate)

    def rate_of(s: float, y: np.ndarray) -> np.ndarray:
        g, memory = law(kind, sizes, y[1] - y[0], y[3] - y[2], y[4])
        f = np.array([g, -g + np.interp(s, fine, many)])
        return np.concatenate([y[2:4], np.linalg.solve(M, f - K @ y[:2] - C @ y[2:4]), [memory]])

    # one step at a time: a formula of many steps may chatter for minutes at a corner of a law
    sol = solve_ivp(
        rate_of, (0, t[-1]), np.zeros(5), "Radau", t, rtol=1e-6, atol=1e-9, max_step=1e-3
    )
    own = sol.y[1] - sol.y[0]
    assert a.shape == (160, 2)
    # the ends of the interpolated force differ, as the two periodic continuations do
    assert np.linalg.norm((x - own)[:140]) < 0.03 * np.linalg.norm(own)
