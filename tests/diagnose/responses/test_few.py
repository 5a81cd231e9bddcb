"""Changes along few directions, at any size: those of the models that grow; several tunings at once
are each by itself."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.responses.few import Few, Tunings, _inverse
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.physics.low_rank import low_rank
from tests.cases.effects import context_of, problem
from tests.cases.elements import grid
from tests.diagnose.responses.undamped import UNDAMPED, candidates, without_damping


@pytest.mark.parametrize(
    "name", ["grounding_spring", "added_mass", "viscous_damper", "stiffness_change"]
)
def test_a_change_of_any_size_is_that_of_the_model_that_grows(make_scene, name):
    model, start, signals, context = make_scene()
    n = len(start.parameters)
    point = without_damping(start, model, signals)
    few = Few.of(point)
    compared = 0
    for c in candidates(context, name):
        change = low_rank(c)
        if change is None:
            continue
        sizes = np.array([0.4, 25.0]) if c.limits[1] > 30.0 else np.array([0.2, 0.9])
        J = few.rows(change, sizes)
        for k, size in enumerate(sizes):
            grown = setting_for(c.change.model, model, signals, 75.0)
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


def test_tunings_of_a_place_are_tried_together(make_scene):
    model, start, signals, context = make_scene()
    few = Few.of(without_damping(start, model, signals))
    every = candidates(context, "attached_resonator")
    here = [c for c in every if c.action.row == every[0].action.row]
    changes = tuple(low_rank(c) for c in here)
    assert len(changes) > 3
    sizes = few.sizes(here[0], changes[0])
    together = few.tuned(Tunings(changes), sizes)
    each = np.hstack([few.rows(change, sizes) for change in changes])
    np.testing.assert_allclose(together, each, rtol=1e-12, atol=1e-12 * np.abs(each).max())


def test_two_rows_are_inverted_in_closed_form():
    rng = np.random.default_rng(3)
    for r in (2, 3):
        A = rng.normal(size=(5, 4, r, r)) + 1j * rng.normal(size=(5, 4, r, r))
        np.testing.assert_allclose(_inverse(A), np.linalg.inv(A), rtol=1e-9)
        with pytest.raises(np.linalg.LinAlgError):
            _inverse(np.zeros((1, r, r), dtype=complex))


def test_what_is_set_free_is_heard_by_more_than_the_modes_of_the_band(tmp_path):
    """The stiffness of a pinned edge all but cancels against what the structure gives way by there,
    most of which is in none of the few modes that responses need."""
    xs, ys = np.linspace(0.0, 0.5, 9).tolist(), np.linspace(0.0, 0.35, 7).tolist()
    around = [i + 1 for i in range(63) if i % 9 in (0, 8) or i // 9 in (0, 6)]
    text = {**grid(xs, ys), "supports": [{"nodes": around, "dofs": ["z"]}]}
    spec = problem(tmp_path, text)
    model = build_model(spec)
    edges = EqualSupports().candidates(context_of(spec, model))
    edge = next(e for e in edges if e.place.nodes == tuple(range(56, 63)))
    change, m = low_rank(edge), model.matrices(model.zero())
    modes = natural_modes(m.K, m.M, 20)

    def at_rest(answered):
        shapes = SimpleNamespace(answered=answered)
        setting = SimpleNamespace(model=model, shapes=shapes)
        point = SimpleNamespace(setting=setting, p=model.zero(), modes=modes)
        return Few(point, (), (), 1.0)._at(change, 1.0 / modes.eigenvalues[None, :])[0].real

    W = np.zeros((model.size, len(change.weights)))
    W[change.used] = change.W
    wanted = W.T @ np.linalg.solve(m.K.toarray(), W)
    np.testing.assert_allclose(at_rest(()), wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
    by_modes = at_rest(tuple(range(model.size)))
    left, right = (np.linalg.eigvalsh(G + np.diag(change.behind)) for G in (by_modes, wanted))
    assert right.max() < 0.0 and left.max() < 10.0 * right.max()
