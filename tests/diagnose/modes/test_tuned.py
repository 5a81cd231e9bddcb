"""Hidden oscillators beside tables of modes: what is tried in the space of the model's modes is
what the model with one has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.diagnose.modes import tuned
from cvxupdate.diagnose.settings import SHAPES_OFF
from cvxupdate.fe.modes import model_modes
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


def test_a_softer_table_is_one_of_larger_deviations(tried):
    _, base, _ = tried
    where = scene_of(base)
    same = where.softened(0.0)
    lam = where.many.eigenvalues[where.used][None]
    entries = [where.many.shapes[rows, where.used[u]][None] for u, rows, _, _ in where.shapes]
    assert same.left(lam, entries) == pytest.approx(where.left(lam, entries), rel=1e-9)
    soft = where.softened(0.03)
    for (_, measured, hard), (_, _, weight) in zip(where.values, soft.values, strict=True):
        own = 0.5 / (measured * hard)
        assert 0.5 / (measured * weight) == pytest.approx(np.hypot(own, 0.03))
    for (_, _, x, hard), (_, _, _, wide) in zip(where.shapes, soft.shapes, strict=True):
        assert wide == pytest.approx(np.hypot(hard, SHAPES_OFF * 0.03 * np.abs(x).max()))
    assert soft.left(lam, entries)[0] < 0.5 * where.left(lam, entries)[0]


@pytest.mark.parametrize("tried", [True], ids=["shapes"], indirect=True)
@pytest.mark.parametrize(("label", "part"), [("n7.z", 0.024), ("n11.z", 0.013)])
def test_a_valley_narrower_than_the_grid_is_found(tried, label, part):
    """Of a table whose frequencies are known to 1e-4, as two states of one structure are: tuning
    and mass lie between those of the grid."""
    evidence, base, _ = tried
    model = base.setting.model
    heavy, row = float(model.total_mass()), model.place[label]
    candidates = evidence.candidates(model, ("attached_resonator",))
    grid = np.unique([c.action.frequency for c in candidates])
    f = float(np.sqrt(grid[5] * grid[6]))
    grown = attach(model, row, f, part * heavy, 0.0)
    modes = model_modes(grown, 4, np.zeros(len(base.p) + 2))
    known = evidence.tables.fit[0]
    at = [grown.place[c.label] for c in known.channels]
    shapes = modes.shapes[at, :4].T / np.abs(modes.shapes[:, :4]).max()
    table = replace(
        known,
        frequency=modes.frequencies[:4],
        frequency_std=1e-4 * modes.frequencies[:4],
        shapes=shapes,
        shape_std=np.full(shapes.shape, 0.01),
    )
    now = replace(evidence, tables=replace(evidence.tables, fit=(table,)))
    where = scene_of(now.evaluated(now.bases[0].setting, now.model.zero()))
    scores = tuned.tuned(where, candidates, heavy)
    best = next(s for s in scores if s.effect.action.row == row)
    assert best is scores[0] and 1.0 - best.fraction < 1e-5
    assert best.effect.action.frequency == pytest.approx(f, rel=0.01)
    assert best.p[0] == pytest.approx(part * heavy, rel=0.05)
