"""Recordings on the right half-plane: exact for runs from rest, honest about noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from cvxupdate.recordings.measured import DECAY
from cvxupdate.recordings.types import Channel, Origin, TimeHistory
from tests.cases.signals import signal_of

M, K, C = 1.3, 1.3 * (2 * np.pi * 11.0) ** 2, 2 * 0.004 * 1.3 * 2 * np.pi * 11.0


def receptance(s):
    return 1.0 / (M * s**2 + C * s + K)


def run(seed=0, samples=16384, rate=800.0, sigma=0.0):
    """A single degree of freedom from rest under noise of 4 to 30 Hz."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / rate
    force = scipy.signal.sosfiltfilt(
        scipy.signal.butter(6, (4.0, 30.0), "bandpass", fs=rate, output="sos"),
        rng.normal(size=samples),
    )
    force *= np.clip(t / 0.5, 0, 1)
    x = scipy.signal.lsim(([1.0], [M, C, K]), force, t)[1]
    clean = np.column_stack([force, x / x.std()])
    data = clean + np.column_stack([np.zeros(samples), sigma * rng.normal(size=samples)])
    channels = (Channel(1, "x", "force"), Channel(1, "x", "displacement"))
    return TimeHistory(Origin("run", "test"), rate, channels, data), float(x.std())


def per_sample(history):
    """The noise that a signal's deviations stand for: of each of the samples, which decay as
    e^{−δt}."""
    n = len(history.data)
    decay = np.linalg.norm(np.exp(-DECAY * np.arange(n) / n)) / history.rate
    return signal_of(history).std[0, 0, 0] / decay


def test_runs_from_rest_give_transfer_functions_without_averaging():
    history, size = run()
    lines = signal_of(history)
    assert lines.order == 0 and np.all(lines.s.real > 0) and lines.sensors == ("n1.x",)
    expected = receptance(lines.s) * lines.U[:, 0, 0] / size
    gap = np.linalg.norm(lines.Y[:, 0, 0] - expected) / np.linalg.norm(expected)
    assert gap < 5e-3, gap


def test_noise_is_estimated_beside_the_band():
    history, _ = run(seed=5, sigma=0.05)
    assert per_sample(history) == pytest.approx(0.05, rel=0.08)


def test_noise_below_the_leakage_of_the_run_is_not_understated():
    """A run that is cut while it still rings leaks into the quiet lines: the estimate errs to the
    safe side, here by half a per cent of the signal."""
    history, _ = run(seed=5, sigma=0.002)
    assert 0.0019 < per_sample(history) < 0.008


def test_noise_of_lines_is_that_of_their_samples():
    history, _ = run(seed=7, samples=4096)
    rng = np.random.default_rng(8)
    quiet = signal_of(history)
    gaps = []
    for _ in range(6):
        noisy = replace(
            history,
            data=history.data
            + np.column_stack(
                [np.zeros(len(history.data)), 0.05 * rng.normal(size=len(history.data))]
            ),
        )
        lines = signal_of(noisy)
        gaps.append(np.mean(np.abs(lines.Y - quiet.Y) ** 2) / np.mean(lines.std**2))
    assert np.mean(gaps) == pytest.approx(1.0, rel=0.25)


def test_a_channel_without_variance_takes_that_of_the_others(lab, measure):
    frf = measure(lab(), 2)
    variance = frf.variance.copy()
    variance[:, 2] = np.nan
    assert np.all(np.isfinite(signal_of(replace(frf, variance=variance)).std))


def test_missing_variances_are_taken_from_those_there_are(lab, measure):
    frf = measure(lab(), 2)
    variance = frf.variance.copy()
    variance[::2, 0] = np.nan
    std = signal_of(replace(frf, variance=variance)).std
    assert np.all(np.isfinite(std)) and np.all(std > 0)
    assert std[0, 0, 0] == pytest.approx(np.sqrt(frf.variance[0, 0, 0]))
