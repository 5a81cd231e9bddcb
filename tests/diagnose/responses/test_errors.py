"""Errors of modelled responses, channel by channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.correlate.response_error import together
from cvxupdate.diagnose.fit import fitted_at
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.errors import (
    channel_errors,
    heard,
    likelihood,
    on_signals,
    stated,
)
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.physics.fault import Fault
from tests.cases.signals import signal_of


def test_error_is_zero_for_the_truth_and_one_for_nothing(chain, lab, measure):
    _, model = chain
    signal = signal_of(measure(lab(), 2, noise=1e-6))
    deaf = tuple(Fault(label, "gain") for label in signal.sensors)
    setting = setting_for(undamped(model), model, (signal,), 75.0, deaf)
    p = np.zeros(len(setting.columns))
    point = setting.evaluate(p)
    truth = (replace(signal, Y=point.modelled()[0]),)
    assert channel_errors(point, truth) == 0.0
    assert [e.value for e in stated(point, truth)] == [0.0]
    p[-len(deaf) :] = -1.0  # every channel reads nothing
    nothing = setting.evaluate(p)
    assert channel_errors(nothing, (signal,)) == pytest.approx(1.0)
    assert [e.value for e in stated(nothing, (signal,))] == [pytest.approx(1.0)]


def test_nothing_recorded_has_no_error(chain, lab, measure):
    _, model = chain
    signal = signal_of(measure(lab(), 2))
    setting = setting_for(undamped(model), model, (signal,), 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    assert np.isnan(channel_errors(point, ())) and stated(point, ()) == []
    assert np.isnan(together((), "fit"))
    assert on_signals(point, (signal,)).setting.signals == (signal,)


def test_a_mode_damped_away_says_nothing_of_another_drive(chain, lab, measure):
    """What was fitted keeps its error; what was held out is foretold with the usual damping where
    that does better, and as fitted where the fit does."""
    _, model = chain
    signals = tuple(signal_of(measure(lab(), k, noise=1e-6, seed=k)) for k in (4, 1))
    setting = setting_for(undamped(model), model, signals[:1], 75.0)
    usual = np.zeros(len(setting.columns))
    lost = usual.copy()
    lost[setting.ratios.start + 1] = 3.0
    right, away = fitted_at(setting, usual), fitted_at(setting, lost)
    fit, held = (channel_errors(away.point, (s,)) for s in signals)
    said = heard(away.point, signals[:1], signals[1:])
    errors = said.errors
    assert errors.fit == fit
    assert errors.hold_out == channel_errors(right.point, signals[1:]) < held
    assert said.likelihood == pytest.approx(likelihood(right, signals[1:]))
    assert said.likelihood > likelihood(away, signals[1:])
    heavy = replace(setting, zeta=setting.zeta * np.exp(-lost[setting.ratios]))
    kept = heard(heavy.evaluate(lost), signals[:1], signals[1:]).errors
    assert kept.hold_out == pytest.approx(errors.hold_out)
