"""Accelerometers: one at a node, or one in each direction that is measured there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.physics.sensor_mass import SensorMass
from tests.cases.effects import context_of, nuisance, problem
from tests.cases.rigs import frame


def placed(tmp_path, labels):
    spec = problem(tmp_path, frame())
    context = context_of(spec, nuisance(undamped(build_model(spec))))
    return SensorMass().candidates(replace(context, accelerometers=labels))


def grown(effect, m):
    """The mass matrix with accelerometers of m kg."""
    model = effect.action.plant(effect, effect.change.model, np.zeros(1), 1.0).model
    p = model.zero()
    p[-1] = m / model.parameters[-1].unit_size
    return model.matrices(p).M.toarray() - model.matrices(model.zero()).M.toarray()


def test_where_no_node_is_measured_twice_there_is_one_way(tmp_path) -> None:
    (one,) = placed(tmp_path, ("n2.x", "n7.z"))
    assert "one for each" not in one.title + one.says({"m": 0.01})


def test_two_directions_at_a_node_are_one_accelerometer_or_two(tmp_path) -> None:
    """Elsewhere both ways are the same; the two are different hypotheses."""
    one, each = placed(tmp_path, ("n2.x", "n2.z", "n7.z", "n7.z"))
    assert one.key != each.key and one.place == each.place
    assert "one for each direction that is measured, loads" in each.says({"m": 0.01})
    single, double = (grown(e, 0.01) for e in (one, each))
    assert np.isclose(np.diag(single).sum(), 4 * 0.01)  # two nodes, two directions in the plane
    assert np.isclose(np.diag(double).sum(), 6 * 0.01)
    assert set(np.round(np.diag(double)[np.diag(double) > 0], 12)) == {0.01, 0.02}


def test_at_any_size_the_directions_are_those_of_the_model(tmp_path) -> None:
    """The low-rank form of the change moves the eigenvalues as the model does."""
    _, each = placed(tmp_path, ("n2.x", "n2.z", "n7.z"))
    along, model = each.change.along, each.change.model
    p = model.zero()
    p[-1] = 3.0
    m = model.matrices(p)
    bare = model.matrices(model.zero())
    added = np.zeros(bare.M.shape)
    added[np.ix_(along.used, along.used)] = along.W @ np.diag(3.0 * along.weights) @ along.W.T
    wanted = scipy.linalg.eigh(m.K.toarray(), m.M.toarray(), eigvals_only=True)[:6]
    found = scipy.linalg.eigh(bare.K.toarray(), bare.M.toarray() + added, eigvals_only=True)[:6]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_accelerometers_are_a_quarter_of_the_structure_at_most(tmp_path) -> None:
    """Of a portal of 260 kg eight weighed 11 kg each, in place of a hoist of 28 kg."""
    spec = problem(tmp_path, frame())
    model = build_model(spec)
    (one,) = placed(tmp_path, ("n2.x", "n7.z"))
    unit = one.change.model.parameters[-1].unit_size
    assert np.isclose(2 * one.limits[1] * unit, 0.25 * model.total_mass())
