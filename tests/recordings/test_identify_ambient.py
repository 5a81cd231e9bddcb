"""Modes from responses alone: near the truth, deviations that cover it, noise that is no mode."""

from functools import cache

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify.ambient import identify_ambient
from cvxupdate.recordings.types import Channel, Origin, TimeHistory

M = np.diag([2.0, 1.5, 1.0, 1.7])
K = 1e3 * np.array([[15.0, -6, 0, 0], [-6, 14, -8, 0], [0, -8, 13, -5], [0, 0, -5, 5]])
C = 0.3 * M + 2e-4 * K + np.diag([0.0, 3.0, 0.0, 0.0])
RATE = 100.0


def truth():
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values, vectors = np.linalg.eig(A)
    keep = values.imag > 0.0
    rank = np.argsort(np.abs(values[keep]))
    return A, values[keep][rank], vectors[:n, keep].T[rank]


@cache
def record(seconds, seed, noise=0.02, channels=(0, 1, 2, 3)):
    """Velocities under white forces at every mass: exact in discrete time, stationary."""
    A, _, _ = truth()
    rng = np.random.default_rng(seed)
    Ad = scipy.linalg.expm(A / RATE)
    B = np.vstack([np.zeros((4, 4)), np.linalg.inv(M)])
    Q = scipy.linalg.solve_continuous_lyapunov(A, -B @ B.T)
    step = Q - Ad @ Q @ Ad.T
    L = np.linalg.cholesky(0.5 * (step + step.T) + 1e-18 * np.eye(8))
    count = int(seconds * RATE)
    x = np.linalg.cholesky(Q) @ rng.standard_normal(8)
    drive = rng.standard_normal((count, 8)) @ L.T
    states = np.empty((count, 8))
    for k in range(count):
        states[k] = x
        x = Ad @ x + drive[k]
    y = states[:, 4:][:, list(channels)]
    y = y + noise * y.std(axis=0) * rng.standard_normal(y.shape)
    places = tuple(Channel(k + 1, "x", "velocity") for k in channels)
    return TimeHistory(Origin("chain", "test"), RATE, places, y)


def test_modes_and_their_deviations():
    _, poles, vectors = truth()
    f, z = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    pulls = []
    for seed in range(2):
        found = identify_ambient(record(600.0, seed), (1.0, 30.0), max_order=40)
        assert found.frequency.size == 4
        pulls.append((found.frequency - f) / found.frequency_std)
        pulls.append((found.damping - z) / found.damping_std)
        for shape, std, true in zip(found.shapes, found.shape_std, vectors, strict=True):
            wanted = true / true[np.argmax(np.abs(shape))]
            assert np.all(np.abs(shape - wanted) < 5.0 * std + 1e-3)
    assert 0.3 < np.sqrt(np.mean(np.square(pulls))) < 2.0
    assert np.abs(pulls).max() < 4.5


def test_a_few_channels_and_no_band():
    found = identify_ambient(record(900.0, 5, channels=(0, 3)), max_order=40)
    f = np.abs(truth()[1]) / (2 * np.pi)
    assert min(np.abs(found.frequency - g).min() / g for g in f) < 2e-3
    assert found.shapes.shape == (found.frequency.size, 2)


def test_uncalibrated_channels_tell_the_poles():
    h = record(600.0, 0)
    volts = tuple(Channel(0, "", "voltage") for _ in h.channels)
    found = identify_ambient(
        TimeHistory(h.origin, h.rate, volts, 0.1 * h.data), (1.0, 30.0), max_order=40
    )
    assert np.allclose(found.frequency, np.abs(truth()[1]) / (2 * np.pi), rtol=0.01)


def test_white_noise_has_no_modes():
    rng = np.random.default_rng(0)
    places = tuple(Channel(k, "x", "acceleration") for k in (1, 2, 3))
    noise = TimeHistory(Origin("n", "n"), RATE, places, rng.standard_normal((30000, 3)))
    with pytest.raises(RecordingError, match="do not stand above their scatter"):
        identify_ambient(noise, (1.0, 30.0), max_order=30)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda h: identify_ambient(h, (1.0, 80.0)), "show nothing above 50 Hz"),
        (lambda h: identify_ambient(_cut(h, 100), (1.0, 30.0)), "too few"),
        (lambda h: identify_ambient(_dead(h), (1.0, 30.0)), "n2.x does not move"),
    ],
)
def test_what_cannot_be_identified_says_why(change, says):
    with pytest.raises(RecordingError, match=says):
        change(record(60.0, 1))


def _cut(h, samples):
    return TimeHistory(h.origin, h.rate, h.channels, h.data[:samples])


def _dead(h):
    data = h.data.copy()
    data[:, 1] = 0.0
    return TimeHistory(h.origin, h.rate, h.channels, data)
