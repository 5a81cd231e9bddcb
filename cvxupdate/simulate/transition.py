"""The linear part over steps of every length, in closed form by matrix exponentials."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from cvxupdate.forces.laws import Real
from cvxupdate.simulate.kernel import Steps
from cvxupdate.simulate.system import System


def transitions(system: System, dt: float, levels: int) -> Steps:
    """Steps of dt / 2^l, l < ``levels``."""
    hard = system.laws.set_valued
    E, W0, W1, Wb = (
        np.stack(a) for a in zip(*(_one(system.A, dt / 2**l) for l in range(levels)), strict=True)
    )
    ends = [_answer(system, W1[l]) for l in range(levels)]
    over = [_answer(system, W0[l] + W1[l]) for l in range(levels)]
    bubble = [_answer(system, Wb[l]) for l in range(levels)]
    D = [
        np.stack([np.where(hard, o[k], e[k]) for e, o in zip(ends, over, strict=True)])
        for k in (0, 1)
    ]
    B = [np.stack([np.where(hard, 0.0, b[k]) for b in bubble]) for k in (0, 1)]
    return Steps(
        E,
        W0,
        W1,
        Wb,
        D[0],
        D[1],
        B[0],
        B[1],
        *(np.ascontiguousarray(a) for a in (system.pull.T, system.x_rows, system.v_rows)),
    )


def _one(A: Real, h: float) -> tuple[Real, Real, Real, Real]:
    """E, W0, W1, Wb of one length. With φ_k the integrals of e^{(1−τ)hA} τ^{k−1}/(k−1)! over a
    step, a force u₀ + (u₁ − u₀) τ + 4 b τ (1 − τ) has the weights h (φ₁ − φ₂), h φ₂,
    h (4 φ₂ − 8 φ₃)."""
    n = len(A)
    M = np.zeros((n, 8, 8))
    M[:, :2, :2] = h * A
    for k in range(3):
        M[:, 2 * k : 2 * k + 2, 2 * k + 2 : 2 * k + 4] = np.eye(2)
    P = la.expm(M)[:, :2]
    one, two, three = P[:, :, 2:4], P[:, :, 4:6], P[:, :, 6:8]
    return P[:, :, :2], h * (one - two), h * two, h * (4.0 * two - 8.0 * three)


def _answer(system: System, W: Real) -> tuple[Real, Real]:
    """Displacements and velocities (m, m) of the elements for forces with the weights ``W``."""
    pulled = np.einsum("bij,bjm->bim", W, system.pull.reshape(len(W), 2, -1))
    flat = pulled.reshape(2 * len(W), -1)
    return system.x_rows @ flat, system.v_rows @ flat
