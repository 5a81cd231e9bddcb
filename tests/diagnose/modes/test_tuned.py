"""Hidden oscillators beside tables of modes: what is tried in the space of the model's modes is
what the model with one has."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.diagnose.modes import tuned
from cvxupdate.physics.attached_resonator import attach
from tests.diagnose.modes.test_finite_size import nearest, scene_of, squares


def test_what_is_left_is_that_of_the_grown_model(tried, monkeypatch):
    monkeypatch.setattr(tuned, "FEWEST", 10**6)  # the whole space
    _, base, _ = tried
    where, model = scene_of(base), base.setting.model
    for label, f, m in (("n7.z", 40.0, 0.05), ("n11.z", 150.0, 0.004), ("n4.z", 90.0, 0.2)):
        row = model.place[label]
        grown = attach(model, row, f, m, 0.0)
        now = grown.matrices(np.append(base.p, np.zeros(2)))
        lam, shapes = eigh(now.K.toarray(), now.M.toarray())
        at = nearest(where, where.used, lam, shapes)
        found = tuned.remaining(where, row, np.array([f]), np.array([m]))
        assert found[0] == pytest.approx(squares(where, lam[at], shapes[:, at]), rel=1e-6)


def test_each_place_has_its_best_tuning_and_mass(tried):
    evidence, base, _ = tried
    where, heavy = scene_of(base), float(base.setting.model.total_mass())
    candidates = evidence.candidates(base.setting.model, ("attached_resonator",))
    assert {c.count for c in candidates} == {2}  # undamped modes tell of no dashpot
    scores = tuned.tuned(where, candidates, heavy)
    assert len({s.effect.key for s in scores}) == len(scores) == 12
    best = scores[0]
    grid = [c.action.frequency for c in candidates if c.key == best.effect.key]
    row = best.effect.action.row
    for mass in 0.03 * heavy, 0.003 * heavy:
        left = tuned.remaining(where, row, np.array(grid[:: tuned.EVERY]), np.full(12, mass))
        assert left.min() >= (1.0 - best.fraction) * where.total * (1.0 - 1e-9)
