"""Three masses on springs, driven at the last, from any initial state: exact marching of its state
space with the force as straight lines between fine samples."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.recordings.types import Channel, Origin, TimeHistory

Real = NDArray[np.float64]
SPRINGS, MASSES = (4e4, 5e4, 3e4), (3.0, 2.0, 1.5)
RATE, FINER, ZETA = 200.0, 8, 0.01
STATE = (2e-3, -2e-3, 4e-3, 0.1, 0.0, 0.0)
"""Displacements and velocities: about as large as what the force makes."""


def matrices(softer: float = 1.0) -> tuple[Real, Real, Real]:
    """K, M, C; ``softer`` is a factor on the spring between the first two masses."""
    a, b, c = SPRINGS
    b = b * softer
    K, M = np.array([[a + b, -b, 0], [-b, b + c, -c], [0, -c, c]]), np.diag(MASSES)
    w2, V = la.eigh(K, M)
    return K, M, M @ V @ np.diag(2.0 * ZETA * np.sqrt(w2)) @ V.T @ M


def receptances(f: Real, softer: float = 1.0) -> NDArray[np.complex128]:
    """Accelerations of all masses per force at the last, (lines, 3)."""
    K, M, C = matrices(softer)
    force = np.array([0.0, 0.0, 1.0])
    return np.array([-(w**2) * la.solve(K - w**2 * M + 1j * w * C, force) for w in 2.0 * np.pi * f])


def history(
    state: tuple[float, ...] = (0.0,) * 6,
    softer: float = 1.0,
    seconds: float = 8.0,
    seed: int = 0,
    noise: float = 0.005,
) -> TimeHistory:
    """Force and three accelerations; ``noise`` in parts of each one's standard deviation."""
    K, M, C = matrices(softer)
    rng, n, dt = np.random.default_rng([14, seed]), int(seconds * RATE), 1.0 / (RATE * FINER)
    f = np.fft.rfftfreq(n, 1.0 / RATE)
    lines = rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))
    spectrum = np.zeros(n * FINER // 2 + 1, dtype=complex)
    spectrum[: len(f)] = np.where((f > 2.0) & (f < 60.0), lines, 0.0)
    force = np.fft.irfft(spectrum, n * FINER)
    force *= 30.0 / force.std()
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-la.solve(M, K), -la.solve(M, C)]])
    B = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / MASSES[2]])
    whole = np.zeros((8, 8))
    whole[:6, :6], whole[:6, 6], whole[6, 7] = A, B, 1.0 / dt
    step = la.expm(whole * dt)
    x, out = np.array(state), np.zeros((n, 3))
    for k in range(n * FINER - 1):
        if k % FINER == 0:
            out[k // FINER] = (A @ x + B * force[k])[3:]
        x = step[:6, :6] @ x + step[:6, 6] * force[k] + step[:6, 7] * (force[k + 1] - force[k])
    out += noise * out.std(axis=0) * rng.standard_normal(out.shape)
    channels = (
        Channel(3, "x", "force"),
        *(Channel(i, "x", "acceleration") for i in (1, 2, 3)),
    )
    return TimeHistory(Origin("run", "run"), RATE, channels, np.column_stack([force[::FINER], out]))


MODEL = f"""
title = "Three masses"
[model]
dofs = ["x"]
nodes = [{{ id = 1, x = 0.0 }}, {{ id = 2, x = 1.0 }}, {{ id = 3, x = 2.0 }}]
[[model.elements]]
type = "spring"
dof = "x"
rows = [
  {{ id = 1, nodes = [1], k = {SPRINGS[0]}, group = "lower" }},
  {{ id = 2, nodes = [1, 2], k = {SPRINGS[1]}, group = "middle" }},
  {{ id = 3, nodes = [2, 3], k = {SPRINGS[2]}, group = "upper" }},
]
[[model.elements]]
type = "mass"
rows = [
  {{ id = 11, nodes = [1], m = {MASSES[0]}, group = "a" }},
  {{ id = 12, nodes = [2], m = {MASSES[1]}, group = "b" }},
  {{ id = 13, nodes = [3], m = {MASSES[2]}, group = "c" }},
]
[model.damping]
kind = "modal"
zeta = {ZETA}
"""
