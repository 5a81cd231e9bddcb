"""Explained fractions at finite sizes: effects that derivatives cannot see are seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.responses import finite_size
from cvxupdate.diagnose.responses.finite_size import few_directions, whole_member
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.types import Seed
from tests.diagnose.responses.undamped import candidates


def test_a_size_is_found_where_the_derivative_points_elsewhere(make_scene):
    """A large lump carries resonances past one another: to first order it is hardly seen, at its
    own size it explains nearly everything."""
    model, start, signals, context = make_scene(m=(0, 0, 0, 0.3))
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = Projection.of(linearised(point))
    ranked = first_order(point, candidates(context, "added_mass", "grounding_spring"), left)
    best = max(few_directions(point, ranked, left), key=lambda s: s.fraction)
    first = next(s for s in ranked if s.effect is best.effect)
    assert (best.effect.physics, best.effect.place.nodes) == ("added_mass", (4,))
    assert best.exact
    assert best.fraction > 0.9 > 4.0 * first.fraction
    assert best.p[0] * 0.01 * start.total_mass() == pytest.approx(0.3, rel=0.1)


def test_the_best_on_few_lines_has_its_figures_on_every_line(make_scene, monkeypatch):
    """The same as where all are tried on every line, though fewer are."""
    model, start, signals, context = make_scene(m=(0, 0, 0, 0.3))
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = Projection.of(linearised(point))
    ranked = first_order(point, candidates(context, "added_mass", "grounding_spring"), left)
    every = few_directions(point, ranked, left)
    monkeypatch.setattr(finite_size, "LINES", 40)
    monkeypatch.setattr(finite_size, "EXACT", 1)
    monkeypatch.setattr(finite_size, "OF_EACH", 1)
    few = few_directions(point, ranked, left)
    best = max(every, key=lambda s: s.fraction)
    (same,) = [s for s in few if s.effect is best.effect]
    assert (same.fraction, same.p[0]) == (best.fraction, best.p[0]) and len(few) < len(every)


def test_no_size_beyond_the_bounds_is_tried(make_scene):
    model, start, signals, context = make_scene(m=(0, 0, 0.9, 0))
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = Projection.of(linearised(point))
    small = [replace(c, limits=(-2.0, 2.0)) for c in candidates(context, "added_mass")]
    for score in few_directions(point, first_order(point, small, left), left):
        assert abs(score.p[0]) < 2.0


def test_what_acts_on_the_whole_is_followed_through_sizes(make_scene):
    model, start, signals, context = make_scene(k=(1.35,) * 4)
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    c = next(c for c in candidates(context, "stiffness_change") if len(c.change.members) == 4)
    grown = setting_for(c.change.model, model, signals, 75.0)
    left = Projection.of(linearised(point))
    seed, fraction = whole_member(point, Seed((c,), grown, np.zeros(len(grown.columns))), left)
    assert seed.start[len(start.parameters)] == pytest.approx(0.35, rel=0.15)
    assert fraction > 0.9
