"""Springs that are not straight: a force in the cube of the motion, or in its square."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.internal import internal_forces
from cvxupdate.physics.cubic_stiffness import EVEN, CubicStiffness
from cvxupdate.spec import load_problem
from tests.cases.effects import STRUCTURES, context_of, problem


@pytest.fixture
def both(tmp_path):
    """At one place of a beam: {figure: (effect, planted)}, and the problem."""
    spec = problem(tmp_path, STRUCTURES["beam"])
    model = undamped(build_model(spec))
    found = CubicStiffness().candidates(context_of(spec, model, ()))
    here = [e for e in found if e.place == found[0].place]
    return {
        e.figures[0].name: (e, e.action.plant(e, model, np.array([7e5]), 1e-3)) for e in here
    }, spec


def test_cube_and_square_are_hypotheses_of_their_own(both) -> None:
    effects = {name: e for name, (e, _) in both[0].items()}
    assert set(effects) == {"k3", EVEN} and len({e.key for e in effects.values()}) == 2
    x = np.array([[0.0], [0.1], [-0.1]])
    force = {}
    for name, (_, put) in both[0].items():
        force[name] = internal_forces(put.model, put.model.zero()).laws.trace(x, 0.0 * x)[0][:, 0]
    assert force["k3"][1] == -force["k3"][2] > 0.0, "odd: the same spring both ways"
    assert force[EVEN][1] == force[EVEN][2] > 0.0, "even: stiffer one way, softer the other"


def test_a_sentence_says_which_way(both) -> None:
    effect, _ = both[0][EVEN]
    stiff = effect.says({EVEN: 2e5})
    assert "stiffer towards + and softer towards −" in stiff and "N/m²" in stiff
    assert "stiffer towards − and softer towards +" in effect.says({EVEN: -2e5})
    assert "softening" in both[0]["k3"][0].says({"k3": -2e5})


def test_a_problem_file_says_the_square(both, tmp_path) -> None:
    (_, put), spec = both[0][EVEN], both[1]
    path = tmp_path / "again.toml"
    written = problem_file(spec, Updated(put.model, put.model.zero(), zeta=np.zeros(1)))
    path.write_text(written.text, encoding="utf-8")
    rebuilt = build_model(load_problem(path))
    now, again = (internal_forces(m, m.zero()).laws.values for m in (put.model, rebuilt))
    np.testing.assert_allclose(again, now, rtol=1e-12)
    assert again[0].tolist() == [0.0, 0.0, 7e5, 0.0]
