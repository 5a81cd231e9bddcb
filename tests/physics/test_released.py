"""Supports along an edge of sheets hold their own part of it; feet each hold alike."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.nominal.supports import held_dofs, regrown, release_from
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.context import SearchContext
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


@pytest.mark.parametrize("dof", ["ry", "z"])
def test_what_gives_way_on_finer_parts_does_so_between_its_nodes_too(tmp_path, dof):
    """Rigid, the edge is as it was; as good as free, frequencies are those without its supports."""
    beyond = CLAMPED + CLAMPED.replace("[1, 6, 11, 16]", "[5, 10, 15, 20]")
    spec, file = read(tmp_path, sheet(4, 3, beyond))
    release = release_from(spec, Mesh(analysis_of(spec, file, 8, solid=True)))
    base = release(0, dof)  # nothing is
    m = base.matrices(base.zero())
    place = cache(lambda n, k: regrown(release(n, k), base))
    held = held_dofs(spec, file)
    context = SearchContext(base, m.K, m.M, 900.0, 20.0, ("n8.z",), held, place, 0.01)
    effect = next(
        e
        for e in EqualSupports().candidates(context)
        if set(e.place.nodes) == {1, 6, 11, 16} and e.place.dof == dof
    )
    model = effect.change.model
    assert any(x.startswith(("twist", "bend")) for x in set(model.labels) - set(base.labels))
    rigid = model_modes(base, 5).frequencies
    np.testing.assert_allclose(model_modes(model, 5).frequencies, rigid, rtol=1e-4)
    p = model.zero()
    p[-1] = 1e4
    less = sheet(4, 3, beyond).replace(
        CLAMPED,
        "[[model.supports]]\nnodes = [1, 6, 11, 16]\n"
        f"dofs = {[k for k in ('z', 'rx', 'ry') if k != dof]}\n".replace("'", '"'),
    )
    other, plain = read(tmp_path, less)
    free = analysis_of(other, plain, 8, solid=True).on(plain)
    true = model_modes(undamped(free), 5).frequencies
    own = model_modes(model, 5, p).frequencies
    np.testing.assert_allclose(own[1:], true[1:], rtol=1e-3)  # the first feels what is left
    assert np.any(np.abs(true / rigid - 1.0) > 0.02)


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
