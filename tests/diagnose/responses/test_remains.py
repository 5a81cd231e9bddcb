"""Where the rest is: in frequency, and at which sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.remains import _band, remains
from cvxupdate.diagnose.responses.setting import setting_for
from tests.cases.signals import signal_of


@pytest.fixture(scope="module")
def point(chain, lab, measure):
    """The chain beside recordings of itself with next to no noise."""
    _, model = chain
    m = model.matrices(model.zero())
    sound = measure(replace(lab(), K=m.K.toarray(), M=m.M.toarray()), 4, noise=1e-6)
    setting = setting_for(undamped(model), model, (signal_of(sound),), 75.0)
    return setting.evaluate(np.zeros(len(setting.columns))), sound


def test_a_tone_of_one_sensor_is_told_with_its_band_and_its_sensor(point):
    model, sound = point
    H = sound.H.copy()
    some = (sound.frequency > 30.0) & (sound.frequency < 33.0)
    H[some, 1] += 0.3 * np.sqrt(np.mean(np.abs(H[:, 1]) ** 2))
    says = remains(model, [signal_of(replace(sound, H=H))])
    assert says.startswith("What is left is mostly at 3") and says.endswith(" Hz, at n2.x.")
    low, high = (float(says.split()[k]) for k in (6, 8))
    assert 29.9 <= low < high <= 33.1


def test_what_is_left_at_one_line_is_at_one_frequency(point):
    model, sound = point
    H = sound.H.copy()
    k = int(np.argmin(np.abs(sound.frequency - 31.0)))
    H[k, 1] += 30.0 * np.sqrt(np.mean(np.abs(H[:, 1]) ** 2))
    says = remains(model, [signal_of(replace(sound, H=H))])
    assert says == f"What is left is mostly at {sound.frequency[k]:.3g} Hz, at n2.x."


def test_the_narrowest_band_that_holds_most():
    f = np.arange(1.0, 101.0)
    energy = np.full(100, 1e-6)
    energy[[9, 10, 11, 60]] = 3.0, 3.0, 3.0, 1.0
    assert _band(f, energy) == (10.0, 12.0)
    assert _band(f, np.ones(100))[1] == 100.0


def test_a_part_of_everything_is_spread(point):
    model, sound = point
    noise = np.random.default_rng(1).standard_normal(sound.H.shape)
    H = sound.H + 0.1 * noise * np.sqrt(np.mean(np.abs(sound.H) ** 2, axis=0))
    says = remains(model, [signal_of(replace(sound, H=H))])
    assert says == "What is left is spread over the band."


def test_nothing_is_said_where_noise_is_all(point):
    model, sound = point
    loud = replace(sound, variance=np.ones_like(sound.variance))
    assert remains(model, [signal_of(loud)]) == ""
