"""Whether the response depends on the level: runs of a linear structure agree whatever their length
and their force of the day; one that stiffens does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.signal import StateSpace, lsim

from cvxupdate.diagnose.responses.data import of_one_length, signals_of
from cvxupdate.diagnose.responses.levels import left_between, level_change, state_change
from cvxupdate.diagnose.settings import LEAST_CHANGE, LEVEL_CHANGE
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, TimeHistory

K = np.array([[9.0e4, -4.0e4, 0.0], [-4.0e4, 9.2e4, -5.2e4], [0.0, -5.2e4, 5.2e4]])
M = np.diag([2.0, 1.4, 1.1])
CHANNELS = (Channel(1, "x", "force"), *(Channel(k, "x", "velocity") for k in (1, 2, 3)))


def run(level: float, seconds: float, seed: int, stiffer: float = 0.0, rate: float = 256.0):
    """From rest under a random force, in time; ``stiffer`` N/m between the third mass and ground;
    noise of 0.2 %."""
    stiff = K + np.diag([0.0, 0.0, stiffer])
    lam, phi = eigh(stiff, M)
    damping = M @ phi @ np.diag(2 * 0.01 * np.sqrt(lam)) @ phi.T @ M
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiff, -inverse @ damping]])
    B = np.vstack([np.zeros((3, 1)), inverse[:, :1]])
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    force = level * rng.standard_normal(len(t)) * (t > 0.2)
    _, y, _ = lsim(StateSpace(A, B, np.hstack([np.zeros((3, 3)), np.eye(3)]), 0 * B[:3]), force, t)
    y += 0.002 * np.std(y, axis=0) * rng.standard_normal(y.shape)
    origin = Origin(f"run at {level}", "test", "fit", level=level)
    return TimeHistory(origin, rate, CHANNELS, np.column_stack([force, y]))


def change(*runs):
    return level_change([s for r in of_one_length(runs) for s in signals_of(r)])


@pytest.mark.parametrize("seconds", [20.0, 31.3, 55.0])
def test_a_linear_structure_does_not_depend_on_the_level_however_long_its_runs(seconds) -> None:
    found = change(run(1.0, 20.0, 1), run(3.0, seconds, 2))
    assert found.change < LEAST_CHANGE and not found.exceeds(0.0)


def test_one_that_stiffens_does() -> None:
    found = change(run(1.0, 20.0, 1), run(3.0, 31.3, 2, stiffer=1500.0))
    assert found.exceeds(LEVEL_CHANGE)


def test_the_gain_of_a_sensor_may_change_with_the_level() -> None:
    one, two = run(1.0, 20.0, 1), run(3.0, 20.0, 2)
    gained = replace(two, data=two.data * np.array([1.0, 1.008, 0.993, 1.0]))
    assert change(one, gained).change < LEAST_CHANGE
    broken = replace(two, data=two.data * np.array([1.0, 1.1, 1.0, 1.0]))
    assert change(one, broken).exceeds(LEAST_CHANGE)


def test_noise_of_the_force_channel_is_no_dependence_on_the_level() -> None:
    """Recorded with 1 % of noise, it moves the structure by what it was without."""
    rng = np.random.default_rng(5)
    runs = [run(1.0, 20.0, 1), run(3.0, 20.0, 2)]
    heard = []
    for r in runs:
        noise = 0.01 * np.std(r.data[:, :1]) * rng.standard_normal((len(r.data), 1))
        heard.append(replace(r, data=r.data + np.pad(noise, ((0, 0), (0, 3)))))
    found = change(*heard)
    assert not found.exceeds(LEAST_CHANGE)
    (s,), (bare,) = (signals_of(r) for r in (heard[0], runs[0]))
    loud = np.abs(s.Y) > np.quantile(np.abs(s.Y), 0.9)
    assert np.median(s.std[loud]) > 2.0 * np.median(bare.std[loud])
    stiff = run(3.0, 20.0, 2, stiffer=1500.0)
    assert change(heard[0], stiff).exceeds(LEVEL_CHANGE)


def test_mains_hum_does_not_grow_with_the_level_and_is_no_dependence_on_it() -> None:
    one, two = run(1.0, 24.0, 1), run(8.0, 24.0, 2)
    t = np.arange(len(one.data)) / one.rate
    hum = 0.3 * np.std(one.data[:, 1:], axis=0) * np.sin(2.0 * np.pi * 50.03 * t + 0.4)[:, None]
    heard = [replace(r, data=r.data + np.pad(hum, ((0, 0), (1, 0)))) for r in (one, two)]
    assert not change(*heard).exceeds(LEAST_CHANGE)
    (s,) = signals_of(heard[0])
    (quiet,) = signals_of(one)
    gone = np.setdiff1d(quiet.s.imag, s.s.imag) / (2.0 * np.pi)
    assert 0 < len(gone) < 0.05 * len(quiet.s) and np.all(np.abs(gone - 50.03) < 4.0)


def test_what_a_model_misses_at_every_level_alike_is_no_change_between_them() -> None:
    one, two = (signals_of(r)[0] for r in (run(1.0, 20.0, 1), run(3.0, 20.0, 2)))
    stiff = signals_of(run(3.0, 20.0, 2, stiffer=1500.0))[0]
    missed = [0.2 * s.U[:, :, :] * np.exp(-s.s.real * 0.1)[:, None, None] for s in (one, two)]
    alike = left_between([one], [two], [np.repeat(m, 3, axis=1) for m in missed])
    assert alike < 1e-9
    whole = left_between([one], [stiff], [one.Y, stiff.Y])
    assert whole == pytest.approx(level_change([one, stiff]).change)
    assert np.isnan(left_between([one], [replace(two, level=one.level)], [one.Y, two.Y]))


def test_a_time_history_is_not_compared_with_a_frequency_response() -> None:
    f = np.arange(4.0, 60.0, 0.25)
    s = 2j * np.pi * f[:, None, None]
    H = (s * np.linalg.inv(s**2 * M + s * 2.0 * np.eye(3) + K))[:, :, :1]
    origin = Origin("frf", "test", "fit", level=5.0)
    frf = FrequencyResponse(origin, f, H, "velocity", CHANNELS[1:], CHANNELS[:1], None, None)
    assert change(run(1.0, 20.0, 1), frf) is None
    other = FrequencyResponse(
        Origin("frf 2", "test", "fit", level=9.0),
        f[::2] + 0.1,
        1.3 * H[::2],
        "velocity",
        CHANNELS[1:],
        CHANNELS[:1],
        None,
        None,
    )
    assert change(frf, other).change > 0.2
    one, two = ([*signals_of(r)] for r in (frf, other))
    assert state_change(one, two).change > 0.2
