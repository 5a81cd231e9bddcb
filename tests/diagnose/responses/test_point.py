"""Derivatives of responses with respect to every unknown, against differences; sensor faults in a
fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.errors import channel_errors
from cvxupdate.diagnose.responses.setting import EFFORTS, setting_for
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.fault import Fault
from tests.cases.signals import signal_of

ZETA = 0.005
# An exchange between a gain and a delay of its channels: the order in which faults act matters.
FAULTS = (Fault("n2.x", "gain"), Fault("n2.x", "swap", other="n3.x"), Fault("n3.x", "delay", 1e-3))


@pytest.mark.parametrize(("zeta", "mixed"), [(1e-9, False), (ZETA, False), (ZETA, True)])
def test_derivatives_with_dashpot_damping_and_faults(chain, lab, measure, zeta, mixed):
    """Every unknown: p-values of springs and floors, a dashpot, common and single damping ratios,
    the kind of loss, a gain, an exchange, a delay.

    Modal damping is held while stiffness and mass move (its matrix follows the modes, the
    derivative does not): an error of the order of ζ that is gone without modal damping. Everything
    else is exact with it, too.
    """
    _, model = chain
    start = with_nuisance(undamped(model))
    m = start.matrices(start.zero())
    context = SearchContext(
        start, m.K, m.M, 75.0, 5.0, ("n1.x",), (), lambda node, kind: start, ZETA
    )
    damper = next(c for c in candidates_of(context, ("viscous_damper",)) if c.place.nodes == (2, 3))
    signals = (
        signal_of(measure(lab(c=(0, 0, 9.0, 0)), 4), 0.03),
        signal_of(measure(lab(), 1, seed=2), 0.1),
    )
    setting = setting_for(damper.change.model, model, signals, 75.0, FAULTS)
    setting = replace(setting, zeta=np.full(setting.damped, zeta), mixed=mixed)
    rng = np.random.default_rng(4)
    p = 0.03 * rng.normal(size=len(setting.columns))
    dashpot = len(damper.change.model.parameters) - 1
    p[dashpot] = 0.7  # it is on
    point = setting.evaluate(p)
    A = point.jacobian()
    for j in range(len(p)):
        step = np.zeros(len(p))
        step[j] = 1e-6
        plus, minus = (setting.evaluate(p + sign * step, point).differences[0] for sign in (1, -1))
        wanted = (plus - minus) / 2e-6
        if zeta < 1e-6 and dashpot < j < dashpot + 2 + setting.damped:
            continue  # damping ratios of nothing have no derivative worth a comparison
        held = j < dashpot and zeta > 1e-6
        assert np.linalg.norm(A[:, j] - wanted) < (2 * zeta if held else 2e-5) * np.linalg.norm(
            wanted
        ), setting.columns[j]


def test_derivatives_with_respect_to_frequencies_by_themselves(chain, lab, measure):
    """Modes that are tuned one by one: exact, with sensor faults too."""
    _, model = chain
    signals = (signal_of(measure(lab(), 4), 0.03), signal_of(measure(lab(), 1, seed=2), 0.1))
    for faults, mixed in (((), False), (FAULTS, False), (FAULTS, True), ((), True)):
        setting = setting_for(undamped(model), model, signals, 75.0, faults)
        setting = replace(setting, tuned=True, mixed=mixed)
        p = 0.03 * np.random.default_rng(6).normal(size=len(setting.columns))
        point = setting.evaluate(p)
        A = point.jacobian()
        assert A.shape[1] == len(setting.columns) == len(setting.scales)
        first = setting.ratios.start
        for j in range(first, first + 2 * setting.damped):
            step = np.zeros(len(p))
            step[j] = 1e-6
            plus, minus = (setting.evaluate(p + s * step, point).differences[0] for s in (1, -1))
            wanted = (plus - minus) / 2e-6
            assert np.linalg.norm(A[:, j] - wanted) < 1e-5 * np.linalg.norm(wanted)


@pytest.mark.parametrize("exchanged", [True, False])
def test_exchanged_channels_are_told_by_the_share_that_fits(chain, lab, measure, exchanged):
    """An exchange is whole (p = 0, no error left) or none (p = −1): a fit on sound channels takes
    the share back to nothing."""
    _, model = chain
    nominal = replace(
        lab(), K=undamped(model).matrices().K.toarray(), M=undamped(model).matrices().M.toarray()
    )
    recording = measure(nominal, 3, noise=1e-4)
    if exchanged:
        recording = replace(recording, H=recording.H[:, [0, 3, 2, 1]])
    signal = signal_of(recording, 0.03)
    setting = setting_for(
        undamped(model), model, (signal,), 75.0, (Fault("n2.x", "swap", other="n4.x"),)
    )
    point = setting.evaluate(np.zeros(len(setting.columns)))
    if exchanged:
        assert channel_errors(point, (signal,)) < 1e-3
    found = fitted(setting, np.zeros(len(setting.columns)), EFFORTS["base"])
    assert found.p[-1] == pytest.approx(0.0 if exchanged else -1.0, abs=1e-2)
    assert channel_errors(found.point, (signal,)) < 1e-2


def test_a_recording_without_the_other_channel_is_left_alone(chain, lab, measure):
    _, model = chain
    recording = measure(lab(), 3)
    short = replace(
        recording,
        H=recording.H[:, :2],
        variance=recording.variance[:, :2],
        responses=recording.responses[:2],
    )
    setting = setting_for(
        undamped(model),
        model,
        (signal_of(short, 0.03),),
        75.0,
        (Fault("n2.x", "swap", other="n4.x"),),
    )
    plain = replace(setting, faults=())
    np.testing.assert_array_equal(
        setting.evaluate(np.zeros(len(setting.columns))).modelled()[0],
        plain.evaluate(np.zeros(len(plain.columns))).modelled()[0],
    )
