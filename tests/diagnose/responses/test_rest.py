"""Noise before the force begins."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.responses.rest import QUIET, rest_noise, samples_at_rest


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
