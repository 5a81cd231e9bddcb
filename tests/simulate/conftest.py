"""Small structures with nonlinear elements, and scipy's answer to the same equations."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cvxupdate import forces as nl
from cvxupdate.simulate import system_of

M = np.diag([1.0, 0.7, 1.3])
K = np.array([[220.0, -90.0, 0.0], [-90.0, 210.0, -120.0], [0.0, -120.0, 120.0]])
C = 0.02 * K + 0.1 * M
DASHPOT = np.array([[1.5, -1.5, 0.0], [-1.5, 1.5, 0.0], [0.0, 0.0, 0.0]])
INPUT = np.array([[0.0], [0.0], [1.0]])


def three_masses(laws: nl.Laws, directions: np.ndarray, coupled: bool = True):
    """Three unequal masses, a dashpot that couples the modes; force on the last, all measured."""
    return system_of(M, C + (DASHPOT if coupled else 0.0), K, laws, directions, INPUT, np.eye(3))


def reference(
    laws: nl.Laws, directions: np.ndarray, force, times, y0=None, coupled=True, **options
):
    """scipy's Radau or LSODA on laws without memory; force(t) a function."""
    damping, inverse = C + (DASHPOT if coupled else 0.0), np.linalg.inv(M)
    state = laws.start()

    def rate(t, y):
        q, u = y[:3], y[3:]
        f = laws.force(directions.T @ q, directions.T @ u, state)
        push = INPUT[:, 0] * force(t) - damping @ u - K @ q - directions @ f
        return np.concatenate([u, inverse @ push])

    start = np.zeros(6) if y0 is None else y0
    settings = {"rtol": 1e-9, "atol": 1e-12, "method": "LSODA", "max_step": 0.01} | options
    return solve_ivp(rate, (times[0], times[-1]), start, t_eval=times, **settings).y.T


@pytest.fixture
def lab():
    return SimpleNamespace(
        three_masses=three_masses, reference=reference, M=M, C=C, K=K, DASHPOT=DASHPOT, INPUT=INPUT
    )
