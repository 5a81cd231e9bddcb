"""Modes far above the band, taken together, are what they are one by one."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.high_modes import MISSED, high_modes
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import receptances, respond

N, TOP = 60, 50.0
SENSORS = np.array([3, 17, -1])


def signal(cases, delta=0.0, plain=False):
    rng = np.random.default_rng(3)
    s = delta + 2j * np.pi * np.linspace(2.0, TOP, 90)
    U = (
        np.broadcast_to(np.eye(2), (90, 2, 2)).astype(complex)
        if plain
        else rng.normal(size=(90, 2, cases)) + 1j * rng.normal(size=(90, 2, cases))
    )
    Y = np.ones((90, 3, U.shape[2]), dtype=complex)
    return Signal("a", "fit", None, s, None, Y, U, np.ones(Y.shape), 2, ("a", "b", "c"), ("d", "e"))


def modes():
    rng = np.random.default_rng(5)
    f = np.sort(
        np.concatenate([[0.0], rng.uniform(5.0, 80.0, 12), rng.uniform(95.0, 4000.0, N - 13)])
    )
    return Modes((2 * np.pi * f) ** 2, rng.normal(size=(N, N)), 1)


@pytest.mark.parametrize(
    ("cases", "delta", "plain"), [(1, 0.0, False), (3, 4.0, False), (2, 1.0, True)]
)
@pytest.mark.parametrize(("zeta", "share"), [(0.004, 0.0), (0.9, 0.0), (0.05, 0.7)])
def test_high_modes_together_are_what_they_are_one_by_one(cases, delta, plain, zeta, share):
    sig, m = signal(cases, delta, plain), modes()
    loss = Loss(np.full(N, zeta), share)
    inputs = np.array([8, 30])
    r = respond(sig, m, SENSORS, inputs, loss, None, None)
    assert r.high is not None and r.near < 20
    every = respond(sig, m, SENSORS, inputs, loss, None, None, near=N)
    assert every.high is None
    phi = np.vstack([m.shapes, np.zeros((1, N))])
    d = (
        sig.s[:, None] ** 2
        + 2.0 * (1.0 - share) * zeta * np.sqrt(m.eigenvalues) * sig.s[:, None]
        + m.eigenvalues * (1.0 + 2j * share * zeta)
    )
    plainly = (sig.s**2)[:, None, None] * np.einsum(
        "sm,pm,im,pic->psc", phi[SENSORS], 1.0 / d, phi[inputs], sig.U
    )
    np.testing.assert_allclose(every.raw, plainly, rtol=1e-10, atol=1e-12 * np.abs(plainly).max())
    np.testing.assert_allclose(r.raw, plainly, rtol=1e-10, atol=10 * MISSED * np.abs(plainly).max())
    few = receptances(r, m, np.array([-1, 5, 40]))
    whole = receptances(every, m)
    for mine, theirs in (
        (few.left, whole.left[[-1, 5, 40]]),
        (few.right, whole.right[[-1, 5, 40]]),
    ):
        np.testing.assert_allclose(mine, theirs, atol=10 * MISSED * np.abs(theirs).max())
    assert not np.any(few.left[0]) and not np.any(few.right[0])


def test_slow_poles_are_not_interpolated():
    """Overdamped, a mode far above the band has a pole near it: it keeps a piece of its own."""
    sig, m = signal(1), modes()
    lam = m.eigenvalues
    assert (
        high_modes(sig.s, sig.U, 0, lam, 2.0 * 0.01 * np.sqrt(lam), m.shapes[:2].T, m.shapes[:2].T)
        is not None
    )
    assert (
        high_modes(sig.s, sig.U, 0, lam, 2.0 * 40.0 * np.sqrt(lam), m.shapes[:2].T, m.shapes[:2].T)
        is None
    )
