"""What is known of a model beforehand, beside rows that say the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.fit import fitted_at
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.nominal.scatter import let_far
from cvxupdate.diagnose.nominal.supports import elements_of
from cvxupdate.diagnose.responses.priors import alike
from cvxupdate.diagnose.responses.setting import _from_afar
from cvxupdate.diagnose.responses.signals import independent
from cvxupdate.diagnose.settings import MASS_STD, STIFFNESS_STD


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    from cvxupdate.diagnose.gather import gathered

    real = lab(k=(1, 0.6, 1, 1))
    recordings = [measure(real, 1), measure(real, 4, "hold-out", seed=2)]
    return gathered(*chain, recordings, lambda text: None)


def at(evidence, level):
    base = Hypothesis((), evidence.bases[0])
    return evidence.at_level(base.fit.setting, level)


def groups(setting):
    return [k for k, q in enumerate(setting.model.parameters) if q.of in ("stiffness", "mass")]


def test_what_a_group_is_known_by_counts_once_for_all_rows_that_say_the_same(evidence) -> None:
    sharp = at(evidence, evidence.levels - 1)
    own = groups(sharp)
    usual = [
        STIFFNESS_STD if sharp.model.parameters[k].of == "stiffness" else MASS_STD for k in own
    ]
    times = alike(sharp.signals, sharp.damped)
    assert times > 2.0
    assert sharp.scales[own] * np.sqrt(times) == pytest.approx(usual)
    loose = replace(sharp, loose=True)
    assert loose.scales[own] == pytest.approx(usual)
    free = np.setdiff1d(np.arange(len(sharp.scales)), own)
    assert sharp.scales[free] == pytest.approx(loose.scales[free])


def test_rows_are_independent_in_their_noise_and_in_nothing_else(evidence) -> None:
    signals = at(evidence, evidence.levels - 1).signals
    figures, rows = independent(signals, 4)
    silent = [replace(s, std=0.0 * s.std) for s in signals]
    assert alike(silent, 4) == pytest.approx(rows / figures)
    loud = [replace(s, std=1e3 * np.abs(s.Y).max() + 0.0 * s.std) for s in signals]
    assert alike(loud, 4) == pytest.approx(1.0, rel=1e-3)


def test_groups_that_are_let_go_are_not_held(evidence) -> None:
    sharp = at(evidence, evidence.levels - 1)
    wide = let_far(evidence.model, elements_of(evidence.original))
    setting = replace(evidence.setting(wide, ()), level=sharp.level, signals=sharp.signals)
    own = groups(setting)
    assert setting.scales[own] == pytest.approx(replace(setting, loose=True).scales[own])


def test_from_afar_groups_lead_on_and_near_by_they_do_not(evidence) -> None:
    sharp = at(evidence, evidence.levels - 1)
    start = np.zeros(len(sharp.columns))
    far = fitted_at(sharp, start).misfit
    led = _from_afar(sharp, start)
    assert far > 10.0 and fitted_at(replace(sharp, loose=True), led).misfit < far
    near = replace(sharp, signals=tuple(replace(s, std=1e3 + 0.0 * s.std) for s in sharp.signals))
    assert _from_afar(near, start) is start
