"""Errors of modelled responses, channel by channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.correlate.response_error import together
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.errors import channel_errors, on_signals, stated
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
