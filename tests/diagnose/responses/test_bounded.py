"""A comparison that no line can dominate: its derivative, its bounds, and what it brings near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.bounded import Bounded, BoundedPoint, Gap, Yielding, approached
from cvxupdate.diagnose.responses.setting import EFFORTS, setting_for
from tests.cases.signals import signal_of


@pytest.fixture
def setting(chain, lab, measure):
    """The chain beside two recordings of one that has a lump."""
    _, model = chain
    real = lab(m=(0, 0.8, 0, 0))
    signals = tuple(signal_of(measure(real, k, seed=k), e) for k, e in ((4, 0.03), (1, 0.1)))
    made = setting_for(with_nuisance(undamped(model)), model, signals, 75.0)
    return replace(made, mixed=True)


def test_its_derivative_is_that_of_differences(setting):
    rng = np.random.default_rng(2)
    p = 0.03 * rng.normal(size=len(setting.columns))
    bounded = Bounded(setting)
    here = bounded.evaluate(p)
    A = here.system().A
    for j in range(len(p)):
        step = np.zeros(len(p))
        step[j] = 1e-6
        ends = [bounded.evaluate(p + sign * step, here).differences[0] for sign in (1, -1)]
        wanted = (ends[0] - ends[1]) / 2e-6
        # modal damping is held while stiffness and mass move
        assert np.linalg.norm(A[:, j] - wanted) < 0.011 * np.linalg.norm(wanted)


def test_every_line_is_between_nothing_and_two(setting):
    point = setting.evaluate(np.zeros(len(setting.columns)))
    gap = Gap.of(point)
    assert 0.0 < gap.total < 2.0 * len(gap.measured)
    assert gap.total == pytest.approx(float(np.sum(gap.values**2)))
    exact = (gap.measured - gap.modelled)[:, None]
    J = gap.real_rows(np.hstack([exact, 1e9 * exact, 0.0 * exact])) * gap.weights[:, None]
    nothing, much, same = gap.remaining(J)
    assert nothing < 1e-20 and same == pytest.approx(gap.total)
    assert much == pytest.approx(len(gap.measured), rel=1e-3)


def test_what_is_wrong_by_a_group_is_brought_near(setting):
    """The lump is no group's: the mass of all floors and the springs come as near as they may."""
    start = np.zeros(len(setting.columns))
    before = Gap.of(setting.evaluate(start)).total
    fit, left = approached(setting, start, EFFORTS["coarse"])
    assert left * len(Gap.of(fit.point).measured) < 0.9 * before
    assert fit.rows == 2 * len(Gap.of(fit.point).measured)


def test_the_unknowns_yield_to_a_change_as_least_squares_would(setting):
    """What is left is the least of the linearised gap and the priors together; a change that the
    unknowns make themselves leaves nothing more, one that is nothing to them the same."""
    rng = np.random.default_rng(5)
    point = setting.evaluate(0.02 * rng.normal(size=len(setting.columns)))
    left, gap, scales = Yielding.of(point), Gap.of(point), replace(setting, loose=True).scales
    A = np.vstack([gap.rates(point.jacobian()), np.diag(1.0 / scales)])
    J = 0.1 * rng.normal(size=(len(gap.weights), 3))
    for k in range(3):
        whole = np.concatenate([gap.moved(J[:, [k]])[:, 0], point.p / scales])
        d = np.linalg.lstsq(A, -whole, rcond=None)[0]
        assert left.remaining(J[:, [k]])[0] == pytest.approx(np.sum((whole + A @ d) ** 2))
    assert left.total < gap.total + np.sum((point.p / scales) ** 2)
    np.testing.assert_allclose(np.sum(gap.moved(J) ** 2, axis=0), gap.remaining(J), rtol=1e-12)
    assert BoundedPoint(point).gap.total == gap.total
