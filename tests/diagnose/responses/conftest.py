"""A chain's recordings on the half-plane, and effects at all their places."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from tests.cases.signals import signal_of

WORDS = (
    "stiffness_change",
    "added_mass",
    "grounding_spring",
    "viscous_damper",
    "structural_damping",
    "mass_proportional_damping",
    "sensor_fault",
    "attached_resonator",
)


@pytest.fixture
def scene(chain, lab, measure):
    """(model of the file, nuisance model, signals, point, candidates) with two recordings, one of
    them smoothed more."""
    _, model = chain
    start = with_nuisance(undamped(model))
    m = start.matrices(start.zero())
    signals = tuple(
        signal_of(measure(lab(c=(0, 0, 9.0, 0)), k, seed=k), e) for k, e in ((4, 0.03), (1, 0.1))
    )
    sensors = tuple(dict.fromkeys(label for s in signals for label in s.sensors))
    context = SearchContext(
        start, m.K, m.M, 75.0, 5.0, sensors, (), lambda node, kind: start, 0.005
    )
    candidates = [c for word in WORDS for c in candidates_of(context, (word,))]
    setting = setting_for(start, model, signals, 75.0)
    return model, start, signals, setting.evaluate(np.zeros(len(setting.columns))), candidates


@pytest.fixture
def make_scene(chain, lab, measure):
    """make_scene(lab's changes) → (model of the file, nuisance model, signals, context)."""
    _, model = chain
    start = with_nuisance(undamped(model))
    m = start.matrices(start.zero())

    def make(**changes):
        signals = tuple(signal_of(measure(lab(**changes), k, seed=k), 0.15) for k in (4, 1))
        sensors = tuple(dict.fromkeys(label for s in signals for label in s.sensors))
        return (
            model,
            start,
            signals,
            SearchContext(start, m.K, m.M, 75.0, 5.0, sensors, (), lambda node, kind: start, 0.005),
        )

    return make
