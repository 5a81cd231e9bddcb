"""Noise before the force begins."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.responses.rest import (
    QUIET,
    force_noise,
    rest_noise,
    samples_at_rest,
    through,
)


def force(quiet: int) -> np.ndarray:
    rng = np.random.default_rng(2)
    out = rng.standard_normal((2000, 1))
    out[:quiet] = 0.7
    return out


def test_only_half_of_what_comes_before_the_force_is_surely_at_rest() -> None:
    assert samples_at_rest(force(200)) == 100
    assert samples_at_rest(force(20)) == QUIET
    assert samples_at_rest(force(5)) == 0


def test_noise_at_rest_is_bounded_from_above() -> None:
    rng = np.random.default_rng(4)
    drive = force(80)
    inside = 0
    for _ in range(50):
        motion = 10.0 * drive + 3.0 + 0.2 * rng.standard_normal((2000, 1))
        motion[:80] -= 7.0
        bound = float(rest_noise(motion, drive)[0])
        assert bound == pytest.approx(0.2 * (1.0 + 2.0 / np.sqrt(80.0)), rel=0.5)
        inside += bound >= 0.2
    assert inside >= 45


def test_nothing_is_said_without_rest_without_force_or_without_scatter() -> None:
    motion = np.random.default_rng(1).standard_normal((2000, 2))
    assert np.all(np.isinf(rest_noise(motion, force(0))))
    assert np.all(np.isinf(rest_noise(motion, np.zeros((2000, 0)))))
    motion[:100] = 1.0
    assert np.all(np.isinf(rest_noise(motion, force(100))))


def spectra(values: np.ndarray) -> np.ndarray:
    return np.fft.rfft(values, axis=0)[:, :, None]


def test_noise_of_a_force_channel_is_told_at_rest() -> None:
    rng = np.random.default_rng(7)
    heard = force(400) + 0.01 * rng.standard_normal((2000, 1))
    assert force_noise(heard) == pytest.approx(0.01, rel=0.3)
    assert force_noise(force(0)) == force_noise(force(400)) == 0.0  # it never rests; a simulation


def test_it_is_in_the_responses_where_lines_were_forced() -> None:
    """A filter of what was sent, set beside what was recorded of it."""
    rng = np.random.default_rng(3)
    lines = np.fft.rfft(rng.standard_normal(4000))
    lines[:100] = lines[1500:] = 0.0
    clean = np.fft.irfft(lines, 4000)[:, None]
    noise = 0.02 * np.std(clean)
    heard = clean + noise * rng.standard_normal(clean.shape)
    response = 5.0 * spectra(clean)
    response[1600:1650] = 7.0  # harmonics: no line was forced there
    U = spectra(heard)
    told = through(np.array([noise * np.sqrt(4000.0)]), response, U)
    gap = np.abs(response - 5.0 * U)[100:1500]
    assert np.sqrt(np.mean(told[100:1500] ** 2)) == pytest.approx(
        np.sqrt(np.mean(gap**2)), rel=0.15
    )
    assert np.all(told[1600:1650] < 0.03 * 7.0)


def test_a_force_without_noise_makes_none() -> None:
    U = spectra(force(0))
    assert not np.any(through(np.zeros(1), U, U))
