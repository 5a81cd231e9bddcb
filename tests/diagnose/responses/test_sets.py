"""Sets of elements at finite sizes, in the modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.responses import finite_size, sets
from cvxupdate.diagnose.responses.finite_size import few_directions
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.sets import (
    Reduced,
    Today,
    _changed,
    _weighted,
    sets_of_elements,
)
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.screen.projection import Projection
from tests.diagnose.responses.undamped import UNDAMPED, candidates, without_damping


def test_a_set_of_elements_in_the_modes_is_that_of_the_model_that_grows(make_scene):
    model, start, signals, context = make_scene()
    n = len(start.parameters)
    point = without_damping(start, model, signals)
    c = next(c for c in candidates(context, "stiffness_change") if len(c.change.members) > 1)
    shapes = point.modes.shapes
    K = np.zeros((start.size, start.size))
    for block in c.change.tangent[0]:
        for dofs, part in zip(block.dofs, block.K, strict=True):
            free = dofs >= 0
            K[np.ix_(dofs[free], dofs[free])] += part[np.ix_(free, free)]
    reduced = Reduced(c, shapes.T @ K @ shapes, np.zeros((start.size, start.size)))
    grown = setting_for(c.change.model, model, signals, 75.0)
    q = np.zeros(len(grown.columns))
    q[n], q[n + 1] = 0.6, UNDAMPED
    wanted = point.differences[1] * (grown.evaluate(q).differences[0] - point.differences[0])
    sizes, weights = np.array([-0.3, 0.6]), [1.0 / s.scale() for s in signals]
    today = [Today.of(r, start.size) for r in point.responses]
    J = _weighted(point, weights, _changed(point, today, reduced, sizes, sizes))
    np.testing.assert_allclose(J[:, 1], wanted, rtol=1e-6, atol=1e-8 * np.abs(wanted).max())


def test_mass_in_the_modes_too_and_none_where_it_would_not_be_positive(make_scene):
    """With all of the mass of the modes times 1.5 and of the stiffness, frequencies stay and
    responses are divided; at mass times −1 nothing is said."""
    model, start, signals, context = make_scene()
    point = without_damping(start, model, signals)
    c = next(c for c in candidates(context, "stiffness_change"))
    lam = np.diag(np.maximum(point.modes.eigenvalues, 0.0))
    reduced = Reduced(c, lam, np.eye(len(lam)))
    today = [Today.of(r, start.size) for r in point.responses]
    sizes = np.array([0.5, -2.0])
    for r, change in zip(
        point.responses, _changed(point, today, reduced, sizes, sizes), strict=True
    ):
        np.testing.assert_allclose(change[..., 0], r.raw * (1.0 / 1.5 - 1.0), rtol=1e-8)
        assert not np.any(change[..., 1])


def test_a_set_s_size_is_found_too(make_scene):
    model, start, signals, context = make_scene(k=(1.0, 1.5, 1.0, 1.0))
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = Projection.of(linearised(point))
    ranked = first_order(point, candidates(context, "stiffness_change"), left)
    exact = [*few_directions(point, ranked, left), *sets_of_elements(point, ranked, left)]
    best = max(exact, key=lambda s: s.fraction)
    assert best.effect.change.members == (102,)
    assert best.p[0] == pytest.approx(0.5, rel=0.1)
    assert {len(s.effect.change.members) for s in exact} > {
        1
    }  # single elements by the closed form, sets in the modes


def test_the_right_set_is_found_wherever_it_stands_to_first_order(make_scene, monkeypatch):
    """On few lines all are compared; on all lines, here, only the best of these."""
    monkeypatch.setattr(sets, "EXACT", 1)
    monkeypatch.setattr(finite_size, "LINES", 40)
    model, start, signals, context = make_scene(k=(1.0, 0.55, 0.55, 1.0))
    setting = setting_for(start, model, signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    left = Projection.of(linearised(point))
    ranked = first_order(point, candidates(context, "stiffness_change"), left)
    members = [s.effect.change.members for s in ranked]
    assert (102, 103) in members
    last = [
        replace(s, fraction=-1.0 if m == (102, 103) else s.fraction)
        for s, m in zip(ranked, members, strict=True)
    ]
    (found,) = sets_of_elements(point, last, left)
    assert found.effect.change.members == (102, 103)
    assert found.p[0] == pytest.approx(-0.45, abs=0.05)


def test_a_set_in_the_modes_is_the_sum_of_its_elements(make_scene):
    model, start, signals, context = make_scene()
    point = without_damping(start, model, signals)
    effects = candidates(context, "stiffness_change")
    assert any(len(e.change.members) == 1 for e in effects)
    for e, mine in zip(effects, sets._reduced(effects, point.modes.shapes), strict=True):
        alone = Reduced.of(e, point.modes.shapes)
        np.testing.assert_allclose(mine.K, alone.K, atol=1e-9 * np.abs(alone.K).max())
