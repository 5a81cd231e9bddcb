"""Hidden oscillators beside responses: a narrow resonance between two trial frequencies is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.responses.few import Few
from cvxupdate.diagnose.responses.finite_size import few_directions
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.oscillators import tuned
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.settings import STARTS
from cvxupdate.diagnose.types import Score
from tests.diagnose.responses.undamped import candidates

MASS = 0.03  # kg


@pytest.fixture
def hidden(make_scene):
    """hidden(node, between) → (point of the model without it, candidates, its tuning): recordings
    of the model with an oscillator there, tuned half-way between two trial frequencies."""
    model, start, signals, context = make_scene()
    every = candidates(context, "attached_resonator")

    def make(node, between):
        own = [c for c in every if c.place.nodes == (node,)]
        f = float(np.sqrt(own[between].action.frequency * own[between + 1].action.frequency))
        action = own[0].action
        grown = action.attach(start, action.row, f, MASS, action.zeta)
        there = setting_for(grown, model, signals, 75.0)
        answers = there.evaluate(np.zeros(len(there.columns))).modelled()
        heard = tuple(replace(s, Y=y) for s, y in zip(signals, answers, strict=True))
        setting = setting_for(start, model, heard, 75.0)
        return setting.evaluate(np.zeros(len(setting.columns))), every, f

    return make


@pytest.mark.parametrize("node, between", [(2, 12), (4, 17), (3, 20)])
def test_it_is_tuned_between_trial_frequencies(hidden, node, between):
    point, every, f = hidden(node, between)
    left = Projection.of(linearised(point))
    found = few_directions(point, first_order(point, every, left), left, left)
    best = max(found, key=lambda s: s.fraction)
    assert best.effect.place.nodes == (node,)
    assert best.effect.action.frequency == pytest.approx(f, rel=0.02)
    assert best.p[0] == pytest.approx(MASS, rel=0.3)
    trial = [s for s in every if s.place.nodes == (node,)]
    off = min(abs(c.action.frequency / f - 1.0) for c in trial)
    assert off > 0.04


def test_every_place_is_heard_however_well_others_do(hidden):
    """Each at no more tunings than it may begin at; what is no oscillator stays as it is."""
    point, every, _ = hidden(2, 12)
    left, few = Projection.of(linearised(point)), Few.of(point)
    scores = [Score(c, 0.0, np.zeros(c.count)) for c in every]
    other = replace(scores[0], effect=replace(every[0], action=None))
    found = tuned(few, few, [other, *scores], left)
    assert found[0] is other
    places = [s.effect.place.nodes for s in found[1:]]
    assert {*places} == {c.place.nodes for c in every}
    assert max(places.count(p) for p in {*places}) <= STARTS


def test_one_tuning_of_each_place_is_left_as_it_is(hidden):
    """As where another place is tried for an oscillator that was fitted."""
    point, every, _ = hidden(2, 12)
    left, few = Projection.of(linearised(point)), Few.of(point)
    first = {c.place.nodes: Score(c, 0.0, np.zeros(c.count)) for c in every}
    assert tuned(few, few, [*first.values()], left) == [*first.values()]
