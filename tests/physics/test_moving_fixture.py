"""Clamps on fixtures that move and turn: the structure put together by hand."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.physics.flexible_support import FlexibleSupport
from cvxupdate.physics.moving_fixture import MovingFixture
from cvxupdate.spec import load_problem
from tests.cases.elements import toml
from tests.cases.rigs import FEET, eigenvalues, frame, frame_context

FIGURES = {"k": 7e5, "m": 1.3, "kr": 900.0, "J": 0.004}


@pytest.fixture
def context(tmp_path: Path):
    return frame_context(tmp_path)


def by_hand(folder: Path):
    """Every foot set free on springs with masses."""
    out = copy.deepcopy(frame())
    out["supports"] = [s for s in out["supports"] if s["nodes"] == "all"]
    rows = [
        {"id": 900 + 10 * i + j, "nodes": [n], "dof": dof, "k": FIGURES["kr" if j == 2 else "k"]}
        for i, n in enumerate(FEET)
        for j, dof in enumerate(("x", "z", "ry"))
    ]
    lumps = [
        {"id": 950 + i, "nodes": [n], "m": FIGURES["m"], "Iyy": FIGURES["J"]}
        for i, n in enumerate(FEET)
    ]
    out["elements"] += [{"type": "spring", "rows": [row]} for row in rows]
    out["elements"] += [{"type": "mass", "rows": lumps}]
    path = folder / "real.toml"
    path.write_text(f"model = {toml(out)}\n", encoding="utf-8")
    return eigenvalues(undamped(build_model(load_problem(path))))


def test_it_is_the_structure_put_together_by_hand(tmp_path, context) -> None:
    effect = MovingFixture().candidates(context)[0]
    assert effect.place.nodes == FEET
    model = effect.change.model
    own, p = model.parameters[-4:], model.zero()
    rigid = [q.value(model, own[q.index], 0.0, 0.0)[0] for q in effect.figures]
    for q, stiff in zip(effect.figures, rigid, strict=True):
        value = FIGURES[q.name]
        size = 1.0 / value - 1.0 / stiff if q.name in ("k", "kr") else value
        p[len(p) - 4 + q.index] = size / own[q.index].unit_size
    said, _ = effect.reported(model, own, p[-4:], 0.0 * p[-4:])
    assert said == pytest.approx(FIGURES, rel=1e-9)
    np.testing.assert_allclose(eigenvalues(model, p), by_hand(tmp_path), rtol=2e-4)


def test_trial_fixtures_begin_at_the_same_frequency_both_ways(context) -> None:
    for effect in MovingFixture().candidates(context)[::7]:
        model, start = effect.change.model, effect.change.start(3.0)
        said, _ = effect.reported(model, model.parameters[-4:], start, 0.0 * start)
        alone = said["k"] / said["m"], said["kr"] / said["J"]
        assert alone[0] == pytest.approx(alone[1], rel=1e-3)


def test_a_clamp_may_turn_with_an_inertia_of_its_own(context) -> None:
    turning = [e for e in FlexibleSupport().candidates(context) if e.place.dof == "ry"]
    assert {e.place.nodes for e in turning} == {(n,) for n in FEET}
    assert [q.name for q in turning[0].figures] == ["kr", "J"]
    said = turning[0].says({"kr": 800.0, "J": 0.002})
    assert "an inertia of its own: 0.00200 kg·m² on 800 N·m/rad" in said


def test_an_inertia_that_does_nothing_is_not_said(context) -> None:
    effect = MovingFixture().candidates(context)[0]
    assert "0.00400 kg·m² on 900 N·m/rad (alone at 117 and 75.5 Hz)" in effect.says(FIGURES)
    bare = effect.says({**FIGURES, "J": 1e-13})
    assert "turns: 700 kN/m, 900 N·m/rad, while" in effect.says({**FIGURES, "m": 1e-13, "J": 0.0})
    assert "kg·m²" not in bare and "(alone at 117 Hz)" in bare
