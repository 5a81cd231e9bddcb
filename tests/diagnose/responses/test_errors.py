"""Errors of modelled responses, channel by channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cvxupdate.diagnose.responses.fit import setting_for
from cvxupdate.diagnose.responses.lines import frf_lines

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.errors import channel_errors, frobenius, on_signals
from cvxupdate.diagnose.responses.signals import smooth
from cvxupdate.physics.fault import Fault


def test_error_is_zero_for_the_truth_and_one_for_nothing(chain, lab, measure):
    _, model = chain
    signal = smooth(frf_lines(measure(lab(), 2, noise=1e-6)), 0.0)
    deaf = tuple(Fault(label, "gain") for label in signal.sensors)
    setting = setting_for(undamped(model), model, (signal,), 75.0, deaf)
    p = np.zeros(setting.size)
    point = setting.evaluate(p)
    truth = (replace(signal, Y=point.modelled()[0]),)
    assert channel_errors(point, truth) == 0.0 and frobenius(point, truth) == 0.0
    p[-len(deaf) :] = -1.0  # every channel reads nothing
    nothing = setting.evaluate(p)
    assert channel_errors(nothing, (signal,)) == pytest.approx(1.0)
    assert frobenius(nothing, (signal,)) == pytest.approx(1.0)


def test_nothing_recorded_has_no_error(chain, lab, measure):
    _, model = chain
    signal = smooth(frf_lines(measure(lab(), 2)), 0.0)
    setting = setting_for(undamped(model), model, (signal,), 75.0)
    point = setting.evaluate(np.zeros(setting.size))
    assert np.isnan(channel_errors(point, ())) and np.isnan(frobenius(point, ()))
    assert on_signals(point, (signal,)).setting.signals == (signal,)
