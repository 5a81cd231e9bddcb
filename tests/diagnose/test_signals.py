"""Recordings on the right half-plane: linear, exact for runs from rest, honest about noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
from cvxupdate.diagnose.signals import Lines, frf_lines, smooth, time_lines, white_noise

from cvxupdate.recordings.types import Channel, Origin, TimeHistory

M, K, C = 1.3, 1.3 * (2 * np.pi * 11.0) ** 2, 2 * 0.004 * 1.3 * 2 * np.pi * 11.0


def receptance(s):
    return 1.0 / (M * s**2 + C * s + K)


def lines_of(H, f):
    return Lines(
        "r",
        "fit",
        None,
        2j * np.pi * f,
        H[:, None, None],
        np.ones((len(f), 1, 1), complex),
        0.01 * np.ones((len(f), 1, 1)),
        0,
        ("n1.x",),
        ("n1.x",),
    )


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


def test_smoothing_is_linear():
    rng = np.random.default_rng(3)
    f = np.arange(2.0, 60.0, 0.05)
    a, b = (lines_of(rng.normal(size=len(f)) + 1j * rng.normal(size=len(f)), f) for _ in range(2))
    both = replace(a, Y=2.5 * a.Y - 1j * b.Y)
    for epsilon in (0.15, 0.016, 0.0):
        np.testing.assert_allclose(
            smooth(both, epsilon).Y,
            2.5 * smooth(a, epsilon).Y - 1j * smooth(b, epsilon).Y,
            atol=1e-12,
        )
    assert smooth(a, 0.0).mix is None and np.array_equal(smooth(a, 0.0).Y, a.Y)


def test_a_constant_stays_and_noise_shrinks():
    f = np.arange(2.0, 60.0, 0.05)
    signal = smooth(lines_of(np.full(len(f), 3.0 - 1.0j), f), 0.05)
    np.testing.assert_allclose(signal.Y, 3.0 - 1.0j, rtol=1e-12)
    assert np.all(signal.std < 0.01), "an average is less noisy than its parts"


def test_smoothing_carries_a_response_into_the_half_plane():
    """Poisson's kernel of half-width δ gives H(δ + iω), for a function analytic to the right,
    inside the band."""
    f = np.arange(0.01, 200.0, 0.004)
    lines = lines_of(receptance(2j * np.pi * f), f)
    width, centre = 0.6, 11.3
    kernel = width / ((centre - f) ** 2 + width**2)
    carried = (kernel / kernel.sum()) @ lines.Y[:, 0, 0]
    exact = receptance(2 * np.pi * (width + 1j * centre))
    assert abs(carried - exact) < 0.02 * abs(exact)
    signal = smooth(lines, 0.05)
    exact = receptance(2 * np.pi * (0.05 * 11.0 + 1j * 11.0))
    modelled = signal.mix @ receptance(signal.s)
    nearest = int(np.argmax(np.abs(signal.Y[:, 0, 0])))
    assert abs(signal.Y[nearest, 0, 0]) < 1.15 * abs(exact), (
        "the peak is lowered to what it is at δ"
    )
    np.testing.assert_allclose(signal.Y[:, 0, 0], modelled, rtol=1e-10)


def test_runs_from_rest_give_transfer_functions_without_averaging():
    history, size = run()
    lines = time_lines(history)
    assert lines.order == 0 and np.all(lines.s.real > 0) and lines.sensors == ("n1.x",)
    expected = receptance(lines.s) * lines.U[:, 0, 0] / size
    gap = np.linalg.norm(lines.Y[:, 0, 0] - expected) / np.linalg.norm(expected)
    assert gap < 5e-3, gap


def test_noise_is_estimated_beside_the_band():
    history, _ = run(seed=5, sigma=0.05)
    assert white_noise(history, [1])[0] == pytest.approx(0.05, rel=0.08)


def test_noise_below_the_leakage_of_the_run_is_not_understated():
    """A run that is cut while it still rings leaks into the quiet lines: the estimate errs to the
    safe side, here by half a per cent of the signal."""
    history, _ = run(seed=5, sigma=0.002)
    assert 0.0019 < white_noise(history, [1])[0] < 0.008


def test_noise_of_lines_is_that_of_their_samples():
    history, _ = run(seed=7, samples=4096)
    rng = np.random.default_rng(8)
    quiet = time_lines(history)
    gaps = []
    for _ in range(6):
        noisy = replace(
            history,
            data=history.data
            + np.column_stack(
                [np.zeros(len(history.data)), 0.05 * rng.normal(size=len(history.data))]
            ),
        )
        lines = time_lines(noisy)
        gaps.append(np.mean(np.abs(lines.Y - quiet.Y) ** 2) / np.mean(lines.std**2))
    assert np.mean(gaps) == pytest.approx(1.0, rel=0.25)


def test_a_channel_without_variance_takes_that_of_the_others(lab, measure):
    frf = measure(lab(), 2)
    variance = frf.variance.copy()
    variance[:, 2] = np.nan
    assert np.all(np.isfinite(frf_lines(replace(frf, variance=variance)).std))


def test_missing_variances_are_taken_from_those_there_are(lab, measure):
    frf = measure(lab(), 2)
    variance = frf.variance.copy()
    variance[::2, 0] = np.nan
    std = frf_lines(replace(frf, variance=variance)).std
    assert np.all(np.isfinite(std)) and np.all(std > 0)
    assert std[0, 0, 0] == pytest.approx(np.sqrt(frf.variance[0, 0, 0]))
