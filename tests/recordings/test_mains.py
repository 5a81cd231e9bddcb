"""Mains hum: a tone that keeps its phase, and no resonance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from cvxupdate.recordings.mains import tones, without
from cvxupdate.recordings.types import Channel, Origin, TimeHistory

RATE, N = 256.0, 6144
CHANNELS = (Channel(1, "x", "force"), Channel(1, "x", "acceleration"), Channel(2, "x", "velocity"))


def record(*columns: np.ndarray) -> TimeHistory:
    return TimeHistory(Origin("run", "test", "fit"), RATE, CHANNELS, np.column_stack(columns))


def hum(frequency: float, amplitude: float) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * frequency * np.arange(N) / RATE + 0.7)


@pytest.mark.parametrize("frequency", [49.95, 50.02, 60.0, 100.04])
def test_a_tone_is_found_in_every_channel_of_motion_where_one_has_it(frequency: float) -> None:
    rng = np.random.default_rng(1)
    force, one, two = rng.standard_normal((3, N))
    found = tones(record(force + hum(frequency, 1.0), one + hum(frequency, 0.3), two))
    assert [t.channel for t in found] == [1, 2], "a force that is measured acts, hum or not"
    assert found[0].frequency == pytest.approx(frequency, abs=0.5 * RATE / N)
    assert abs(found[0].amplitude) == pytest.approx(0.3, rel=0.15)
    assert abs(found[1].amplitude) < 4.0 * found[1].error < 0.2
    cleaned = without(record(force, one + hum(frequency, 0.3), two), found).data
    assert np.std(cleaned[:, 1] - one) < 0.2 * np.std(hum(frequency, 0.3))
    assert np.array_equal(cleaned[:, 0], force)
    s = 0.3 + 2j * np.pi * np.array([frequency, frequency + 5.0])
    assert found[0].unsure(s)[0] > 50.0 * found[0].unsure(s)[1]


def test_neither_noise_nor_a_resonance_nor_a_tone_elsewhere_is_hum() -> None:
    rng = np.random.default_rng(2)
    assert not tones(record(*rng.standard_normal((3, N))))
    force, noise = rng.standard_normal((2, N))
    w, decay = 2.0 * np.pi * 50.0 / RATE, np.exp(-0.004 * 2.0 * np.pi * 50.0 / RATE)
    rings = lfilter([1.0], [1.0, -2.0 * decay * np.cos(w), decay**2], force)
    assert not tones(record(force, rings, noise))
    assert not tones(record(force, noise + hum(53.0, 1.0), noise))


def test_a_record_too_short_to_tell_says_nothing() -> None:
    rng = np.random.default_rng(3)
    short = record(*rng.standard_normal((3, N)))
    cut = TimeHistory(short.origin, RATE, CHANNELS, short.data[:100] + hum(50.0, 5.0)[:100, None])
    assert not tones(cut)
