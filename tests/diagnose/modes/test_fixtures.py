"""Fixtures beside tables of modes: what is tried in the space of the model's modes is what the
model on one has."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.diagnose.modes import fixtures
from tests.diagnose.modes.test_finite_size import nearest, scene_of, squares


def test_what_is_left_is_that_of_the_grown_model(tried, monkeypatch):
    monkeypatch.setattr(fixtures, "FEWEST", 10**6)  # the whole space
    evidence, base, _ = tried
    where, model = scene_of(base), base.setting.model
    found = fixtures.on_fixtures(where, evidence.candidates(model, ("flexible_support",)), base.p)
    assert {s.effect.count for s in found} == {2, 4}  # along or about one axis, and all of a clamp
    for s in found:
        now = s.effect.change.model.matrices(np.append(base.p, s.p))
        lam, shapes = eigh(now.K.toarray(), now.M.toarray())
        at = nearest(where, where.used, lam, shapes)
        left = squares(where, lam[at], shapes[:, at])
        assert left == pytest.approx((1.0 - s.fraction) * where.total, rel=1e-5, abs=1e-6)


def test_few_modes_tell_nearly_the_same(tried):
    evidence, base, _ = tried
    where, model = scene_of(base), base.setting.model
    one = next(e for e in evidence.candidates(model, ("flexible_support",)) if e.count == 4)
    sizes, grown = fixtures._sizes(one), one.change.model
    few = fixtures.Stood.of(where, grown, base.p, one.count)
    k, m = fixtures.Feet.of(grown, model.size, base.p, one.count).at(sizes)
    for row in (2, 8):
        now = grown.matrices(np.append(base.p, sizes[row]))
        lam, shapes = eigh(now.K.toarray(), now.M.toarray())
        at = nearest(where, where.used, lam, shapes)
        left = few.left(where, k[row : row + 1], m[row : row + 1])[0]
        assert left == pytest.approx(squares(where, lam[at], shapes[:, at]), rel=0.02, abs=0.5)
