"""Linear effects and the laws that look like them at one level."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import cvxupdate
from cvxupdate import Frf, Model, Modes, Problem
from cvxupdate.diagnose.apart.laws import FACTORS, LAWS, twins
from cvxupdate.diagnose.apart.measurement import LawCheck
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from
from cvxupdate.diagnose.types import Score
from cvxupdate.report.plan_apart import apart_csv, law_rows, laws_says
from cvxupdate.report.plan_page import plan_page
from cvxupdate.study import open_problem
from tests.diagnose.apart.test_apart import LINES, beam, chain, told

FORCES = {
    "cubic_stiffness": lambda x, v: x**3,
    "quadratic_damping": lambda x, v: v * abs(v),
    "dry_friction": lambda x, v: np.sign(v),
}


def held(k: float, damper: bool = False) -> Model:
    """The chain with a spring (or a dashpot) from its second mass to ground."""
    ends = [[1], [1, 2], [2, 3], [3, 4], [4, 5], [5]]
    blocks: list[dict[str, Any]] = [
        {"type": "spring", "dof": "x", "nodes": ends, "k": [1.0e4] * 6},
        {"type": "mass", "nodes": [[i] for i in range(1, 6)], "m": [1.0] * 5},
    ]
    kind = {"type": "dashpot", "c": [k]} if damper else {"type": "spring", "k": [k]}
    blocks.append({"dof": "x", "nodes": [[2]], **kind})
    x = np.array([[float(i), 0.0] for i in range(5)])
    return Model(x, blocks, dofs=["x"], damping={"kind": "modal", "zeta": 0.01})


def measured(true: Model) -> Problem:
    exact = true.frf(LINES, ["n3.x"], ["n3.x"], "acceleration").H
    rng = np.random.default_rng(5)
    std = 0.005 * np.abs(exact)
    noise = std * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape))
    keys: dict[str, Any] = {"quantity": "acceleration", "variance": 2 * std**2}
    return Problem(chain(), [Frf(LINES, exact + noise, ["n3.x"], ["n3.x"], **keys)])


@pytest.mark.parametrize("law", sorted({law for some in LAWS.values() for law in some}, key=repr))
def test_a_describing_function_goes_with_that_power(law: Any) -> None:
    """Of the force under x = A sin θ the part in phase with the motion, or with the velocity."""

    def equivalent(A: float) -> float:
        force = FORCES[law.physics]
        stiff = law.figure == "k"

        def part(t: float) -> float:
            f = float(force(A * np.sin(t), A * np.cos(t)))
            return f * (np.sin(t) if stiff else np.cos(t)) / (np.pi * A)

        points = [0.5 * np.pi, 1.5 * np.pi]
        return float(quad(part, 0.0, 2.0 * np.pi, points=points)[0])

    for factor in FACTORS:
        assert equivalent(0.3 * factor) / equivalent(0.3) == pytest.approx(
            factor**law.power, rel=1e-7
        )


def fitted(evidence: Any, physics: str, size: float) -> Hypothesis:
    base = Hypothesis((), evidence.bases[-1])
    effect = next(
        e for e in evidence.candidates(evidence.model, (physics,)) if len(e.place.nodes) == 1
    )
    seed = seed_from(evidence, base, Score(effect, 1.0, np.array([size]), exact=True), 3)
    assert seed is not None
    return Hypothesis(seed.effects, evidence.evaluated(seed.setting, seed.start))


@pytest.mark.parametrize("physics", ["grounding_spring", "joint_flexibility", "viscous_damper"])
def test_figures_go_with_that_power(physics: str, tmp_path: Any) -> None:
    """Also of joints, whose unknown is a compliance."""
    lines = np.arange(20.0, 320.0, 2.0)
    H = beam(3).frf(lines, ["n4.z"], ["n4.z"], "acceleration")
    spec, model, recordings = open_problem(Problem(beam(), [H]).save(tmp_path))[:3]
    evidence = gathered(spec, model, recordings, lambda text: None)
    h = fitted(evidence, physics, 0.7)
    found = list(twins([h, Hypothesis((), evidence.bases[-1])]))
    assert [t.law for t in found] == list(LAWS[physics])
    for t in found:
        own = h.fit.setting.model.parameters[t.index]
        q = next(q for q in t.effect.figures if q.name == t.law.figure)
        now = q.value(h.fit.setting.model, own, float(h.fit.p[t.index]), 0.0)[0]
        for factor, size in zip(FACTORS, t.sizes, strict=True):
            then = q.value(h.fit.setting.model, own, size, 0.0)[0]
            assert then == pytest.approx(now * factor**t.law.power, rel=1e-5)


def test_a_spring_that_matters_is_told_from_a_law_and_a_faint_one_is_not() -> None:
    strong, faint = (
        cvxupdate.plan(
            measured(held(k)), modes=3, diagnosis=told(2, 4, physics="grounding_spring")
        ).data
        for k in (800.0, 1.0)
    )
    law = strong.apart.laws[0]
    assert law.effect == "A spring to ground at node 2 (x)"
    assert law.power == 2.0 and law.factors == FACTORS
    assert min(law.separations) > 3.0
    assert max(law.separations) > max(faint.apart.laws[0].separations)
    assert faint.apart.laws[0].separations[2] < 1.0  # 4 N/m for 1 beside 10 kN/m
    says = laws_says(strong.apart)
    assert "a hardening or softening spring there differ by" in says
    assert says in plan_page(strong)
    line = next(x for x in strong.apart.lines if x.startswith("No level"))
    assert line in plan_page(strong)
    assert [r[0] for r in apart_csv(strong.apart)].count("level") == len(strong.apart.laws)
    assert law_rows(strong.apart)[0]["law"] == law.law


def test_a_dashpot_may_be_friction_or_drag() -> None:
    found = cvxupdate.plan(
        measured(held(6.0, damper=True)), modes=3, diagnosis=told(2, 4, physics="viscous_damper")
    ).data.apart
    assert {x.power for x in found.laws} == {1.0, -1.0}
    assert len(found.laws) == 4
    drag, friction = found.laws[:2]
    # what halves one doubles the other
    assert drag.separations == pytest.approx(friction.separations[::-1], rel=1e-6)


def test_frequencies_tell_a_law_too_by_the_shift_over_its_deviation() -> None:
    f = held(800.0).modes(3).frequencies
    plans = [
        cvxupdate.plan(
            Problem(chain(), [Modes(f, frequency_std=s * f)]),
            modes=3,
            diagnosis=told(2, 4, physics="grounding_spring"),
        ).data.apart
        for s in (1e-3, 1e-2)
    ]
    sharp, rough = (np.array(p.laws[0].separations) for p in plans)
    assert np.all(sharp > rough)
    assert sharp[3] > sharp[2] > 3.0
    assert any("No level" in line for line in plans[0].lines)


def test_masses_are_no_laws() -> None:
    found = cvxupdate.plan(measured(chain(2)), modes=3, diagnosis=told(2, 4)).data.apart
    assert found.laws == () and laws_says(found) == ""
    assert any("No level" in line for line in found.lines)


def test_the_nearest_level_that_tells_surely() -> None:
    def chosen(*separations: float) -> int:
        return LawCheck("A", "b", 2.0, FACTORS, separations).chosen

    assert chosen(9.0, 6.0, 5.5, 20.0) == 1  # half is as near as twice, and asks less
    assert chosen(9.0, 2.0, 5.5, 20.0) == 2
    assert chosen(1.0, 0.5, 2.0, 4.0) == 3
