"""Noise of recordings in time: from rest, where distortion fills the whole spectrum."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.motion.runs import (
    EDGE,
    MOST_SAMPLES,
    from_rest,
    noise_of,
    offset_errors,
    shortened,
)
from cvxupdate.recordings.types import Channel, Origin, TimeHistory

N, NOISE = 4000, 0.0003


def recording(quiet: int, noise: float = NOISE, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Motion (N, 2) that impacts fill up to the last line, with white noise, and the force (N, 1)
    that begins after ``quiet`` samples."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal((N, 1))
    force[:quiet] = 0.0
    hits = np.where(rng.random((N, 2)) < 0.02, rng.standard_normal((N, 2)), 0.0)
    hits[:quiet] = 0.0
    return hits + noise * rng.standard_normal((N, 2)), force


def test_distortion_in_every_line_is_no_noise_where_the_record_begins_at_rest() -> None:
    motion, force = recording(100)
    assert noise_of(motion, force) == pytest.approx([NOISE, NOISE], rel=0.35)


def test_a_noisy_record_from_rest_is_believed() -> None:
    """More than is taken where nothing is known: the samples at rest say so."""
    motion, force = recording(100, noise=0.03)
    assert np.all(noise_of(motion, force) > 0.1 * np.std(motion, axis=0))
    assert noise_of(motion, force) == pytest.approx([0.03, 0.03], rel=0.35)


def test_an_offset_is_known_as_well_as_a_few_samples_tell() -> None:
    rng = np.random.default_rng(5)
    channels = (Channel(1, "x", "force"), Channel(1, "x", "acceleration"))
    data = np.column_stack([np.zeros(N), 0.02 * rng.standard_normal(N)]) + 0.5
    data[100:, 0] += rng.standard_normal(N - 100)
    history = TimeHistory(Origin("a", "a.csv"), 100.0, channels, data)
    error = offset_errors(history)
    assert error[0] == 0.0 and error[1] == pytest.approx(0.02 / 4.0, rel=0.4)
    left = from_rest(history).data[:, 1].mean()
    assert 0.0 < abs(left) < 3.0 * error[1]
    moving = TimeHistory(Origin("a", "a.csv"), 100.0, channels, data[100:])
    assert not np.any(offset_errors(moving))


def test_of_a_long_record_the_beginning_is_fitted() -> None:
    data = np.arange(2.0 * MOST_SAMPLES)[:, None]
    history = TimeHistory(Origin("a", "a.csv"), 100.0, (Channel(1, "x", "force"),), data)
    np.testing.assert_array_equal(shortened(history).data, data[:MOST_SAMPLES])
    assert shortened(history).rate == history.rate


def test_without_rest_it_is_an_upper_bound() -> None:
    motion, force = recording(0)
    assert noise_of(motion, force) == pytest.approx(0.005 * np.std(motion, axis=0))


def test_a_simulation_that_is_still_at_rest_says_nothing_of_noise() -> None:
    motion, force = recording(100, noise=0.0)
    assert np.all(noise_of(motion, force) > 0.0)


def test_white_noise_is_told_from_the_quietest_stretch() -> None:
    rng = np.random.default_rng(8)
    t = np.arange(N)
    motion = np.sin(2.0 * np.pi * 200.0 * t / N)[:, None] + 1e-3 * rng.standard_normal((N, 1))
    assert noise_of(motion, np.ones((N, 1)) * (t % 7)[:, None]) == pytest.approx([1e-3], rel=0.25)


def test_lines_end_where_anti_alias_filters_begin() -> None:
    """51.2 kHz for 20 kHz, as every analyser has it."""
    assert pytest.approx(20.0) == EDGE * 51.2
