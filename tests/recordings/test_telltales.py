"""Tell-tales on records of two masses whose physics is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.recordings.telltales import (
    asymmetry,
    change,
    halves,
    ring_down,
    stretch,
    unforced,
)
from cvxupdate.recordings.types import Channel, Origin, TimeHistory
from tests.cases.shaken import shaken
from validation.motions.laws import Law

HARDENING = Law("cubic", (4e10,))
STOP = Law("gap", (2e5, 5e-4, 1.0))
RUBBING = Law("friction", (40.0,), 1e-4)
SURE = (0.005, 4.0)


def between(a, b):
    found = change(stretch(a), stretch(b))
    assert found is not None
    return found


def test_a_linear_structure_tells_nothing():
    quiet, loud = shaken(seed=1), shaken(level=4.0, seed=2)
    found = between(quiet, loud)
    assert not found.shifts(*SURE) and not found.widens(*SURE)
    assert abs(found.shift) < 0.01
    for run in (quiet, loud):
        within = halves(run)
        assert within is not None and not within.shifts(*SURE)
        third, deviation = asymmetry(run)
        assert abs(third) < max(0.15, 4.0 * deviation)
        assert unforced(run) < 0.02


def test_a_hardening_spring_moves_resonances_up_with_the_level():
    found = between(shaken(HARDENING, seed=3), shaken(HARDENING, 5.0, seed=4))
    assert found.shifts(*SURE) and found.shift > 0.01


def test_friction_damps_less_when_it_is_louder():
    found = between(shaken(RUBBING, seed=5), shaken(RUBBING, 6.0, seed=6))
    assert found.widens(*SURE) and found.wider < 0.0


def test_a_stop_on_one_side_is_lopsided_and_answers_where_nothing_was_forced():
    run = shaken(STOP, 3.0, seed=7)
    third, deviation = asymmetry(run)
    assert abs(third) > max(0.15, 4.0 * deviation)
    assert unforced(run) > 0.05
    lopsided = replace(run, data=run.data.copy())
    lopsided.data[:, 0] = np.abs(run.data[:, 0])
    assert asymmetry(lopsided) is None


def test_what_changes_between_runs_or_within_one_shows_at_one_level():
    before, after = shaken(seed=8), shaken(seed=9, start=-0.3, end=-0.3)
    found = between(before, after)
    assert found.shifts(*SURE) and -0.12 < found.shift < -0.03
    within = halves(shaken(seed=10, start=0.0, end=-0.3))
    assert within is not None and within.shifts(*SURE) and within.shift < -0.02


def test_halves_that_were_not_forced_alike_are_not_compared():
    run = shaken(seed=1)
    data = run.data.copy()
    data[len(data) // 2 :, 0] *= 0.5
    assert halves(replace(run, data=data)) is None


def decaying(linear: float, rubbing: float, noise: float = 1e-4) -> TimeHistory:
    """x of one degree of freedom at 12 Hz after a blow: dA/dt = −linear A − rubbing."""
    rate, f = 400.0, 12.0
    t = np.arange(3200) / rate
    # A = (A₀ + r/l) e^{−lt} − r/l
    free = np.maximum((1.0 + rubbing / linear) * np.exp(-linear * t) - rubbing / linear, 0.0)
    rng = np.random.default_rng(3)
    quiet = np.zeros(60)
    x = np.concatenate([quiet, free * np.sin(2.0 * np.pi * f * t)])
    x += noise * rng.standard_normal(len(x))
    force = np.zeros(len(x))
    force[60:63] = 50.0
    channels = (Channel(1, "x", "force"), Channel(1, "x", "displacement"))
    return TimeHistory(Origin("blow", "blow.npz"), rate, channels, np.column_stack([force, x]))


def test_a_ring_down_tells_damping_against_amplitude():
    plain = ring_down(decaying(1.5, 0.0))
    assert plain is not None
    assert plain.frequency == pytest.approx((12.0, 12.0), rel=1e-3)
    assert plain.damping == pytest.approx((1.5 / (24.0 * np.pi),) * 2, rel=0.05)
    rubbing = ring_down(decaying(0.4, 0.25))
    assert rubbing is not None and rubbing.damping[1] > 1.5 * rubbing.damping[0]
    assert ring_down(shaken(seed=1)) is None, "forced to the end"
