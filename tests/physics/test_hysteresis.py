"""The forms of a joint that sticks and slips: at once, or gradually."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.internal import internal_forces
from cvxupdate.forces.laws import NAMES
from cvxupdate.physics.hysteresis import KNEES, Hysteresis, other_forms
from cvxupdate.spec import load_problem
from tests.cases.effects import STRUCTURES, context_of, problem

K, FORCE = 2e5, 65.0


def joint(folder):
    """On a beam: (effect, model, problem)."""
    spec = problem(folder, STRUCTURES["beam"])
    model = undamped(build_model(spec))
    return Hysteresis().candidates(context_of(spec, model, ()))[0], model, spec


def law_of(effect, model):
    grown = effect.action.plant(effect, model, np.array([K, FORCE]), 1e-3).model
    return internal_forces(grown, grown.zero()).laws


def test_other_forms_have_the_same_stiffness_and_the_same_limit(tmp_path) -> None:
    effect, model, _ = joint(tmp_path)
    x = np.concatenate([np.linspace(0.0, 1.0, 400), np.linspace(1.0, -1.0, 800)])[:, None] * 3e-3
    v = np.gradient(x, axis=0)
    at_once, _ = law_of(effect, model).trace(x, v)
    for form, n in zip(other_forms(effect), KNEES, strict=True):
        law = law_of(form, model)
        assert NAMES[law.kinds[0]] == "bouc_wen" and law.values[0].tolist() == [K, FORCE, n, 0.5]
        gradually, _ = law.trace(x, v)
        np.testing.assert_allclose(gradually[1] / x[1], K, rtol=0.05)
        assert 0.97 * FORCE < gradually.max() < FORCE and at_once.max() == FORCE
        assert np.all(np.abs(gradually[:400]) <= np.abs(at_once[:400]) + 1e-9)


def test_forms_are_hypotheses_of_their_own_in_the_same_words(tmp_path) -> None:
    effect, _, _ = joint(tmp_path)
    forms = other_forms(effect)
    assert len({e.key for e in (effect, *forms)}) == 1 + len(KNEES)
    assert {(e.physics, e.place, e.title) for e in forms} == {
        (effect.physics, effect.place, effect.title)
    }
    says = forms[1].says({"k": K, "force": FORCE})
    assert "gives way gradually" in says and "n = 2" in says
    assert "slips at" in effect.says({"k": K, "force": FORCE})
    assert other_forms(forms[0]) == [], "only where it slips at once others are tried"


def test_a_problem_file_can_say_them(tmp_path) -> None:
    effect, model, spec = joint(tmp_path)
    for form in other_forms(effect):
        grown = form.action.plant(form, model, np.array([K, FORCE]), 1e-3).model
        written = problem_file(spec, Updated(grown, grown.zero(), zeta=np.zeros(1)))
        (tmp_path / "again.toml").write_text(written.text, encoding="utf-8")
        rebuilt = internal_forces(build_model(load_problem(tmp_path / "again.toml"))).laws
        assert NAMES[rebuilt.kinds[0]] == "bouc_wen"
        np.testing.assert_allclose(rebuilt.values, law_of(form, model).values)
