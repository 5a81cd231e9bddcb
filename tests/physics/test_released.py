"""Supports along an edge of sheets hold their own part of it; feet each hold alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.physics.released import Released, edge_shares
from tests.cases.effects import context_of, nuisance
from tests.fe.analysis.test_solid import CLAMPED, read, sheet

NODES = (1, 6, 11, 16)


@pytest.fixture
def context(tmp_path):
    _, model = read(tmp_path, sheet(4, 3, CLAMPED))
    spec, _ = read(tmp_path, sheet(4, 3, CLAMPED))
    return context_of(spec, nuisance(model))


def test_the_ends_of_an_edge_hold_half(context):
    held = tuple((n, "ry") for n in NODES)
    np.testing.assert_allclose(edge_shares(context.model, held), np.array([1, 2, 2, 1]) / 1.5)
    across = tuple((n, "rx") for n in NODES)
    np.testing.assert_array_equal(edge_shares(context.model, across), 1.0)
    np.testing.assert_array_equal(edge_shares(context.model, ((1, "ry"), (16, "ry"))), 1.0)
    np.testing.assert_array_equal(edge_shares(context.model, ((1, "z"), (6, "z"))), 1.0)


def test_one_number_stands_for_all_of_them(context):
    """The springs by hand, and the change at finite size as it is along few directions."""
    found = {e.place.dof: e for e in EqualSupports().candidates(context)}
    effect = found["ry"]
    assert effect.place.nodes == NODES
    assert "by the length of edge" in effect.says({"k": 300.0})
    assert "by the length" not in found["z"].says({"k": 300.0})
    k, model = 300.0, effect.change.model
    free = Released.of(context, tuple((n, "ry") for n in NODES))
    unit, a0 = model.parameters[-1].unit_size, float(model.blocks[-1].properties["a0"][0])
    p = model.zero()
    p[-1] = (1.0 / k - a0) / unit
    m = model.matrices(p)
    by_hand = free.model.matrices(free.model.zero())
    K = by_hand.K.toarray()
    K[free.rows, free.rows] += k * np.array([1, 2, 2, 1]) / 1.5
    np.testing.assert_allclose(m.K.toarray(), K, rtol=1e-9, atol=1e-9 * K.max())
    stiff = scipy.linalg.eigvalsh(m.K.toarray(), m.M.toarray())[:4]
    base = context.model.matrices(context.model.zero()).K.toarray()
    change = effect.change.along
    gone = 1.0 / (1.0 / (change.weights * (1.0 / k / unit)) + change.behind)
    less = np.zeros_like(base)
    less[np.ix_(change.used, change.used)] = (change.W * gone) @ change.W.T
    n = len(base)
    own = K[n:, n:]
    condensed = K[:n, :n] - K[:n, n:] @ np.linalg.solve(own, K[n:, :n])
    np.testing.assert_allclose(base + less, condensed, atol=1e-8 * np.abs(base).max())
    assert np.all(stiff > 0.0)
