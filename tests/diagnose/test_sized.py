"""Shares at several sizes: closed forms are those of the models that grow; effects that derivatives
cannot see are seen; fits begun from the drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cvxupdate.diagnose.data import ordinary
from cvxupdate.diagnose.effects import Effect, Hypothesis
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.signals import frf_lines, smooth
from cvxupdate.diagnose.sized import (
    _modal,
    _modal_receptance,
    _responses,
    _weighted,
    sized,
    sized_sets,
    sized_whole,
)

from cvxupdate.diagnose.fit import setting_for
from cvxupdate.diagnose.screen import left_over, screen
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.low_rank import amounts, low_rank

# logarithm of the factor on all damping ratios: none is left, so modes that cross keep their
# damping in common
UNDAMPED = -30.0


@pytest.fixture
def scene(chain, lab, measure):
    """scene(lab's changes) → (model of the file, ordinary model, signals, context)."""
    _, model = chain
    start = ordinary(undamped(model))
    m = start.matrices(start.zero())

    def make(**changes):
        signals = tuple(smooth(frf_lines(measure(lab(**changes), k, seed=k)), 0.15) for k in (4, 1))
        sensors = tuple(dict.fromkeys(label for s in signals for label in s.sensors))
        return (
            model,
            start,
            signals,
            SearchContext(start, m.K, m.M, 75.0, 5.0, sensors, (), lambda node, kind: start, 0.005),
        )

    return make


def without_damping(start, model, signals):
    """The ordinary model as drawn, no damping left."""
    setting = setting_for(start, model, signals, 75.0, 5.0)
    p = np.zeros(len(setting.columns))
    p[len(start.parameters)] = UNDAMPED
    return setting.evaluate(p)


def candidates(context, *words):
    return [c for word in words for c in candidates_of(context, (word,))]


@pytest.mark.parametrize(
    "word", ["grounding_spring", "added_mass", "viscous_damper", "stiffness_change"]
)
def test_a_change_of_any_size_is_that_of_the_model_that_grows(scene, word):
    model, start, signals, context = scene()
    n = len(start.parameters)
    point = without_damping(start, model, signals)
    weights = [1.0 / s.scale() for s in signals]
    compared = 0
    for c in candidates(context, word):
        change = low_rank(c)
        if change is None:
            continue
        sizes = np.array([0.4, 25.0]) if c.limits[1] > 30.0 else np.array([0.2, 0.9])
        J = _responses(
            change,
            amounts(c, sizes),
            point,
            [_modal_receptance(point, r) for r in point.responses],
            weights,
        )
        for k, size in enumerate(sizes):
            grown = setting_for(c.change.model, model, signals, 75.0, 5.0)
            q = np.zeros(len(grown.columns))
            q[n], q[n + 1] = size, UNDAMPED
            wanted = point.differences[1] * (
                grown.evaluate(q).differences[0] - point.differences[0]
            )
            np.testing.assert_allclose(
                J[:, k],
                wanted,
                rtol=1e-6,
                atol=1e-8 * np.abs(wanted).max(),
                err_msg=f"{c.name} {size}",
            )
            compared += 1
    assert compared >= 4


def test_a_set_of_elements_in_the_modes_is_that_of_the_model_that_grows(scene):
    model, start, signals, context = scene()
    n = len(start.parameters)
    point = without_damping(start, model, signals)
    c = next(c for c in candidates(context, "stiffness_change") if len(c.change.members) > 1)
    shapes = point.modes.shapes
    K = np.zeros((start.size, start.size))
    for block in c.change.tangent[0]:
        for dofs, part in zip(block.dofs, block.K, strict=True):
            free = dofs >= 0
            K[np.ix_(dofs[free], dofs[free])] += part[np.ix_(free, free)]
    rates = [shapes.T @ K @ shapes, np.zeros((start.size, start.size))]
    grown = setting_for(c.change.model, model, signals, 75.0, 5.0)
    q = np.zeros(len(grown.columns))
    q[n], q[n + 1] = 0.6, UNDAMPED
    wanted = point.differences[1] * (grown.evaluate(q).differences[0] - point.differences[0])
    J = _weighted(point, [1.0 / s.scale() for s in signals], _modal(point, rates, 0.6, 0.6))
    np.testing.assert_allclose(J, wanted, rtol=1e-6, atol=1e-8 * np.abs(wanted).max())


def test_a_size_is_found_where_the_derivative_points_elsewhere(scene):
    """A large lump carries resonances past one another: to first order it is hardly seen, at its
    own size it explains nearly everything."""
    model, start, signals, context = scene(m=(0, 0, 0, 0.3))
    setting = setting_for(start, model, signals, 75.0, 5.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = left_over(point)
    ranked = screen(point, candidates(context, "added_mass", "grounding_spring"), left)
    best = max(sized(point, ranked, left), key=lambda s: s.share)
    first = next(s for s in ranked if s.candidate is best.candidate)
    assert (best.candidate.physics, best.candidate.place.nodes) == ("added_mass", (4,))
    assert best.exact
    assert best.share > 0.9 > 4.0 * first.share
    assert best.p[0] * 0.01 * start.total_mass() == pytest.approx(0.3, rel=0.1)


def test_a_set_s_size_is_found_too(scene):
    model, start, signals, context = scene(k=(1.0, 1.5, 1.0, 1.0))
    setting = setting_for(start, model, signals, 75.0, 5.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = left_over(point)
    ranked = screen(point, candidates(context, "stiffness_change"), left)
    exact = [*sized(point, ranked, left), *sized_sets(point, ranked, left)]
    best = max(exact, key=lambda s: s.share)
    assert best.candidate.change.members == (102,)
    assert best.p[0] == pytest.approx(0.5, rel=0.1)
    assert {len(s.candidate.change.members) for s in exact} > {
        1
    }  # single elements by the closed form, sets in the modes


def test_no_size_beyond_the_bounds_is_tried(scene):
    model, start, signals, context = scene(m=(0, 0, 0.9, 0))
    setting = setting_for(start, model, signals, 75.0, 5.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = left_over(point)
    small = [replace(c, limits=(-2.0, 2.0)) for c in candidates(context, "added_mass")]
    for score in sized(point, screen(point, small, left), left):
        assert abs(score.p[0]) < 2.0


def test_what_acts_on_the_whole_is_followed_through_sizes(scene):
    model, start, signals, context = scene(k=(1.35,) * 4)
    setting = setting_for(start, model, signals, 75.0, 5.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    c = next(c for c in candidates(context, "stiffness_change") if len(c.change.members) == 4)
    grown = setting_for(c.change.model, model, signals, 75.0, 5.0)
    hypothesis, share = sized_whole(
        point, Hypothesis((Effect(c),), grown, np.zeros(len(grown.columns))), left_over(point)
    )
    assert hypothesis.start[len(start.parameters)] == pytest.approx(0.35, rel=0.15)
    assert share > 0.9
