"""A damping ratio for every mode that comes into the band, and one that strayed found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses import setting as module
from cvxupdate.diagnose.responses.setting import (
    EFFORTS,
    MORE,
    counted,
    followed,
    setting_for,
    to_the_end,
    unstrayed,
    with_damped,
)
from cvxupdate.diagnose.settings import MODE_DAMPING_STD
from cvxupdate.errors import ModelError
from cvxupdate.update.trust_region import Options
from tests.cases.plain_evidence import PlainFit
from tests.cases.signals import signal_of


@pytest.fixture
def setting(chain, lab, measure):
    """The chain beside two recordings of one much as it."""
    _, model = chain
    signals = tuple(signal_of(measure(lab(), k, seed=k), e) for k, e in ((4, 0.03), (1, 0.1)))
    made = setting_for(with_nuisance(undamped(model)), model, signals, 75.0)
    return replace(made, mixed=True)


def few(setting, modes: int, tuned: bool = False):
    """The same where only the lowest modes were in the band when it was made."""
    return replace(setting, zeta=setting.zeta[:modes], tuned=tuned)


@pytest.mark.parametrize("tuned", [False, True])
def test_modes_that_come_into_the_band_get_unknowns_of_their_own(setting, tuned):
    """The responses stay as they were, each new unknown moves them, and all that is known of the
    others stays theirs."""
    rng = np.random.default_rng(3)
    short = few(setting, 2, tuned)
    p = 0.05 * rng.normal(size=len(short.columns))
    grown, q = counted(short, p)
    assert grown.damped == 4 and len(q) == len(grown.columns) == len(p) + (4 if tuned else 2)
    known = dict(zip(short.columns, p, strict=True))
    assert {c: v for c, v in zip(grown.columns, q, strict=True) if v} == known
    A = grown.evaluate(q).jacobian()
    assert all(np.linalg.norm(A[:, grown.ratios], axis=0) > 0.0)
    again, same = counted(grown, q)
    assert again is grown and same is q
    old, new = (s.evaluate(x).modelled() for s, x in ((short, p), (grown, q)))
    # modes without a ratio of their own have the median one, less each mode's own
    for a, b in zip(old, new, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12 * abs(a).max())


def test_a_setting_has_as_many_ratios_as_another_but_no_more_than_modes(setting):
    short = few(setting, 2)
    assert with_damped(short, None) is short and with_damped(setting, short) is setting
    whole = with_damped(short, setting)
    np.testing.assert_array_equal(whole.zeta, setting.zeta)
    more = replace(setting, zeta=np.full(7, 0.01))
    grown = with_damped(short, more)
    assert grown.damped == 4
    grown.evaluate(np.zeros(len(grown.columns)))


def test_a_structure_without_modes_in_the_band_is_left_alone(setting):
    short = few(setting, 0)
    p = np.zeros(len(short.columns))
    assert counted(short, p)[1] is p


def test_a_mode_that_was_damped_away_is_found_again(setting, monkeypatch):
    """Where steps end with it, and the usual damping is nearer; not where the recordings have such
    a mode."""
    monkeypatch.setitem(EFFORTS, "first pass", Options(1e-2, 1, 1e-9))  # as good as no step
    best = fitted(setting, np.zeros(len(setting.columns)), EFFORTS["sharp"])
    assert unstrayed(setting, best.p) is None
    lost = best.p.copy()
    lost[setting.ratios.start + 1] = 2.6
    found = followed(setting, lost, "first pass")
    wanted = lost.copy()
    wanted[setting.ratios.start + 1] = 0.0
    np.testing.assert_allclose(found.p, wanted, atol=1e-6)
    assert found.cost < 1.5 * best.cost
    strange = replace(setting, zeta=setting.zeta * np.array([1.0, np.exp(-1.5), 1.0, 1.0]))
    there = best.p.copy()
    there[setting.ratios.start + 1] += 1.5
    kept = followed(strange, there, "first pass")
    np.testing.assert_allclose(kept.p, there, atol=1e-6)


@pytest.mark.parametrize(
    ("left", "fits"),
    [
        pytest.param((0.9,), 0, id="it explains"),
        pytest.param((4.7, 0.4), 1, id="it falls to where it explains"),
        pytest.param((9.0, 8.5), 1, id="it hardly falls"),
        pytest.param((9.0, 7.0, 5.0, 4.0, 3.0), MORE, id="not for ever"),
        pytest.param((50.0, 0.4), 0, id="what is far off leads nowhere"),
    ],
)
def test_a_sharp_fit_that_comes_near_goes_on_while_it_falls(monkeypatch, left, fits):
    """A portal's right set of five effects (the laboratory's 2750) left 4.7 after twelve steps, and
    0.4 after thirty."""
    ends = [PlainFit(x) for x in left]
    asked = []

    def on(setting, start, options):
        asked.append(options)
        return ends[len(asked)]

    monkeypatch.setattr(module, "fitted", on)
    assert to_the_end(None, ends[0]) is ends[fits] and len(asked) == fits


def test_where_modes_are_gone_there_is_no_structure(setting):
    """Without rotary inertia a beam that shears has fewer: no step goes there."""
    more = replace(setting, zeta=np.full(5, 0.01))
    with pytest.raises(ModelError, match="none there"):
        more.evaluate(np.zeros(len(more.columns)))


def test_what_all_modes_in_the_band_have_in_common_is_no_pattern_of_damping(setting):
    """Modes above the band have no damping ratio but the common one, and may draw it away from
    those in the band, which all make up for it: that is not what a damper does."""
    p, own = np.zeros(len(setting.columns)), setting.ratios
    assert setting.damping_strain(p) == 0.0
    p[own.start - 2], p[own] = -0.85, 0.85
    assert setting.damping_strain(p) < 0.1
    p[own.start] += 3.0 * MODE_DAMPING_STD
    n = setting.damped  # one mode off by three deviations, about the mean of all
    assert setting.damping_strain(p) == pytest.approx(9.0 * (1.0 - 1.0 / n), rel=0.1)
