"""Smoothing towards the right half-plane: linear, exact for what is analytic there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.responses.signals import Signal, smoothed, thinned

M, K, C = 1.3, 1.3 * (2 * np.pi * 11.0) ** 2, 2 * 0.004 * 1.3 * 2 * np.pi * 11.0


def receptance(s):
    return 1.0 / (M * s**2 + C * s + K)


def lines_of(H, f):
    return Signal(
        "r",
        "fit",
        None,
        2j * np.pi * f,
        None,
        H[:, None, None],
        np.ones((len(f), 1, 1), complex),
        0.01 * np.ones((len(f), 1, 1)),
        0,
        ("n1.x",),
        ("n1.x",),
    )


def test_smoothing_is_linear():
    rng = np.random.default_rng(3)
    f = np.arange(2.0, 60.0, 0.05)
    a, b = (lines_of(rng.normal(size=len(f)) + 1j * rng.normal(size=len(f)), f) for _ in range(2))
    both = replace(a, Y=2.5 * a.Y - 1j * b.Y)
    for epsilon in (0.15, 0.016):
        np.testing.assert_allclose(
            smoothed(both, epsilon).Y,
            2.5 * smoothed(a, epsilon).Y - 1j * smoothed(b, epsilon).Y,
            atol=1e-12,
        )


def test_a_constant_stays_and_noise_shrinks():
    f = np.arange(2.0, 60.0, 0.05)
    signal = smoothed(lines_of(np.full(len(f), 3.0 - 1.0j), f), 0.05)
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
    signal = smoothed(lines, 0.05)
    exact = receptance(2 * np.pi * (0.05 * 11.0 + 1j * 11.0))
    modelled = signal.mix @ receptance(signal.s)
    nearest = int(np.argmax(np.abs(signal.Y[:, 0, 0])))
    assert abs(signal.Y[nearest, 0, 0]) < 1.15 * abs(exact), (
        "the peak is lowered to what it is at δ"
    )
    np.testing.assert_allclose(signal.Y[:, 0, 0], modelled, rtol=1e-10)


def test_a_smoothed_response_needs_few_points():
    """Fewer than resonances are wide; a sharp recording, and one of so few, stay."""
    f = np.arange(2.0, 24.0, 0.05)
    whole = smoothed(lines_of(receptance(2j * np.pi * f), f), 0.15)
    few = thinned(whole, 64)
    assert len(few.s) == 64 < len(whole.s) / 6
    exact, near = (s.carry @ receptance(s.s) for s in (whole, few))
    assert np.abs(near - exact).max() < 0.125 * np.abs(exact).max()
    sharp = lines_of(receptance(2j * np.pi * f), f)
    assert thinned(sharp, 64) is sharp and thinned(few, 64) is few
