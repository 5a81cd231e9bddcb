"""The forms of a joint that sticks and slips: at once, or gradually."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.internal import internal_forces
from cvxupdate.forces.laws import NAMES
from cvxupdate.physics.hysteresis import EXPONENTS, KNEES, Hysteresis, other_forms
from cvxupdate.physics.internal_force import SLIDERS, spread
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
    for form, n in zip(other_forms(effect)[: len(KNEES)], KNEES, strict=True):
        law = law_of(form, model)
        assert NAMES[law.kinds[0]] == "bouc_wen" and law.values[0].tolist() == [K, FORCE, n, 0.5]
        gradually, _ = law.trace(x, v)
        np.testing.assert_allclose(gradually[1] / x[1], K, rtol=0.05)
        assert 0.97 * FORCE < gradually.max() < FORCE and at_once.max() == FORCE
        assert np.all(np.abs(gradually[:400]) <= np.abs(at_once[:400]) + 1e-9)
    for form in other_forms(effect)[len(KNEES) :]:
        law = law_of(form, model)
        assert law.size == SLIDERS and {NAMES[kind] for kind in law.kinds} == {"jenkins"}
        assert np.sum(law.values[:, :2], axis=0) == pytest.approx([K, FORCE])
        path = np.repeat(x, law.size, axis=1)
        gradually = law.trace(path, np.gradient(path, axis=0))[0].sum(axis=1)
        assert gradually.max() == pytest.approx(FORCE)
        np.testing.assert_allclose(gradually[1] / x[1], K)
        assert np.all(np.abs(gradually[:400]) <= np.abs(at_once[:400, 0]) + 1e-9)


@pytest.mark.parametrize("chi", EXPONENTS)
def test_few_sliders_follow_the_curve_of_very_many(chi: float) -> None:
    """The force of a joint with slip distances like x to the power chi, up to the largest: k x
    where nothing slips, less what has slipped (Iwan 1966; Segalman 2005)."""
    parts = spread(chi)
    slips = parts["force"] / parts["k"]
    largest = (2.0 + chi) / (1.0 + chi)  # whose mean is one
    x = np.linspace(0.0, largest, 200)
    few = np.minimum(x[:, None], slips) @ parts["k"]
    u = x / largest
    many = x * (1.0 - u ** (1.0 + chi)) + u ** (2.0 + chi)
    assert np.abs(few - many).max() < 0.03


def test_forms_are_hypotheses_of_their_own_in_the_same_words(tmp_path) -> None:
    effect, _, _ = joint(tmp_path)
    forms = other_forms(effect)
    assert len({e.key for e in (effect, *forms)}) == 1 + len(KNEES) + len(EXPONENTS)
    assert {(e.physics, e.place, e.title) for e in forms} == {
        (effect.physics, effect.place, effect.title)
    }
    says = forms[1].says({"k": K, "force": FORCE})
    assert "gives way gradually" in says and "n = 2" in says
    assert "Iwan's law, exponent -0.5" in forms[-1].says({"k": K, "force": FORCE})
    assert "slips at" in effect.says({"k": K, "force": FORCE})
    assert other_forms(forms[0]) == [], "only where it slips at once others are tried"


def test_a_problem_file_can_say_them(tmp_path) -> None:
    effect, model, spec = joint(tmp_path)
    for form in other_forms(effect):
        grown = form.action.plant(form, model, np.array([K, FORCE]), 1e-3).model
        written = problem_file(spec, Updated(grown, grown.zero(), zeta=np.zeros(1)))
        (tmp_path / "again.toml").write_text(written.text, encoding="utf-8")
        assert written.tables["model"]["elements"][-1]["type"] == form.action.law
        rebuilt = internal_forces(build_model(load_problem(tmp_path / "again.toml"))).laws
        np.testing.assert_allclose(rebuilt.values, law_of(form, model).values)
