"""Both models beside the recordings, as the page of a diagnosis shows them."""

from __future__ import annotations

import json
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.beside import beside, compared, measured_at, untried
from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.fe.modes import model_modes
from cvxupdate.report.diagnosis_client import not_tried, untested
from cvxupdate.report.diagnosis_modes import mode_rows, moving_modes
from cvxupdate.spec.write import Written
from cvxupdate.study import open_problem
from tests.report.test_diagnosis import FINDING, FOUND

ROOT = Path(__file__).parents[1]
PORTAL = ROOT / "tests" / "strangers" / "portal_exact" / "problem.toml"
TABLE = ROOT / "problems" / "concealed" / "o14" / "problem.toml"
BAR = ROOT / "problems" / "concealed" / "o05" / "problem.toml"


def found(path: Path, factor: float | None) -> Diagnosis:
    """A diagnosis that wrote the problem file itself, all its stiffnesses times ``factor``; none
    where that is None."""
    import re

    if factor is None:
        return replace(FOUND, updated=None, findings=())
    text = re.sub(
        r"^(E *= *)([0-9.e+]+)",
        lambda m: f"{m[1]}{factor * float(m[2]):.6e}",
        path.read_text(),
        flags=re.M,
    )
    return replace(FOUND, updated=Written(tomllib.loads(text), ()))


def test_a_table_of_modes_before_and_after() -> None:
    opened = open_problem(PORTAL)
    shown = beside(*opened, found(PORTAL, 1.21))
    assert shown is not None and shown.geometry is not None and len(shown.modes) > 2
    modes = model_modes(opened[1], 12).flexible().frequencies
    for m in shown.modes:
        assert m.before is not None and m.after is not None and m.measured is not None
        assert np.min(np.abs(modes / m.before - 1.0)) < 1e-9
    same = [m for m in shown.modes if abs(m.after / m.before - 1.1) < 1e-6]
    assert len(same) >= len(shown.modes) - 2, "frequencies go with the root of the stiffness"
    rows = mode_rows(shown)
    assert rows[0]["measured"] != "–" and rows[0]["after_error"].endswith("%")
    assert len(moving_modes(shown)) == min(6, len(shown.modes))
    told = replace(FOUND, beside=shown).to_json()  # the page says that it has every number
    first = told["modes"][0]
    assert (first["measured"], first["after"]) == (shown.modes[0].measured, shown.modes[0].after)
    assert len(told["modes"]) == len(rows) and {"physics", "why"} == set(told["not_tried"][0])
    json.dumps(told["modes"], allow_nan=False)
    assert all("<animate" in picture for _, picture in moving_modes(shown))


def test_a_node_that_an_effect_added_moves_nothing_on_the_page() -> None:
    """A hidden oscillator has a node of its own behind those of the file."""
    opened = open_problem(TABLE)
    table = tomllib.loads(TABLE.read_text())
    model = table["model"]
    last = model["nodes"][-1]
    free = last["id"] + 1
    model["nodes"].append({**last, "id": free})
    number = 1 + max(r["id"] for e in model["elements"] for r in e.get("rows", ()))
    ends = {"nodes": [last["id"], free]}
    model["elements"] += [
        {"type": "spring", "dof": "z", "rows": [{"id": number, **ends, "k": 1e5}]},
        {"type": "mass", "rows": [{"id": number + 1, "nodes": [free], "m": 0.1}]},
    ]
    shown = beside(*opened, replace(FOUND, updated=Written(table, ())))
    assert shown is not None and any(m.shape_after is not None for m in shown.modes)
    nodes = len(opened[1].node_ids)
    assert {len(m.shape_after) for m in shown.modes if m.shape_after is not None} == {nodes}
    assert all(row < nodes for m in shown.modes for row, _, _ in m.motion)
    assert moving_modes(shown)


def test_beside_a_reference_the_other_state_is_shown_and_each_has_every_mode(
    tmp_path: Path,
) -> None:
    """One mode of the model takes one measured mode of a state, and not of both together."""
    tables = tomllib.loads(PORTAL.read_text())
    (once,) = tables["recordings"]
    both = [{**once, "state": state, "name": state} for state in ("reference", "today")]
    path = Path(shutil.copytree(PORTAL.parent, tmp_path / "portal")) / "problem.toml"
    path.write_text(Written({**tables, "recordings": both}, ()).text, encoding="utf-8")
    alone, shown = (
        beside(*open_problem(p), replace(FOUND, updated=None, findings=())) for p in (PORTAL, path)
    )
    assert alone is not None and shown is not None
    assert [(m.measured, m.before) for m in shown.modes] == [
        (m.measured, m.before) for m in alone.modes
    ]
    one, two = (compared(*open_problem(p)).fit["fit"] for p in (PORTAL, path))
    assert one["frequency_error_percent_max"] == pytest.approx(two["frequency_error_percent_max"])


def test_responses_show_the_modes_of_the_models() -> None:
    opened = open_problem(BAR)
    shown = beside(*opened, found(BAR, None))
    assert shown is not None and shown.sensors and shown.forces
    assert all(m.measured is None and m.after is None for m in shown.modes)
    assert shown.sensors == measured_at(opened[2])[0]


def test_what_was_not_tried_has_a_reason() -> None:
    spec = open_problem(PORTAL)[0]
    reasons = dict(untried(spec, FOUND))
    assert "grounding_spring" not in reasons  # it was found
    assert "it takes time histories" in reasons["clearance"]
    assert "by more than chance" in reasons["mass_proportional_damping"], "ratios were measured"
    asked = replace(FOUND, candidates=(), findings=())
    assert "grounding_spring" in dict(untried(spec, asked))
    assert not_tried(FOUND) == ()


def test_what_was_tried_is_not_called_without_a_place() -> None:
    """Whatever little it explains; nor is what was not looked for."""
    spec = open_problem(PORTAL)[0]
    names = ["stiffness_change", "shear_deformation", "joint_flexibility"]
    tried = {"sought": names, "tried": {"stiffness_change": 0.02, "shear_deformation": None}}
    reasons = dict(untried(spec, replace(FOUND, details=tried)))
    assert not {"stiffness_change", "shear_deformation"} & set(reasons)
    assert reasons["joint_flexibility"] == "a joint that gives way: no place for it in this model"
    assert "only the damping" in reasons["mass_change"]
    nothing = dict(untried(spec, replace(FOUND, details={"sought": [], "tried": {}})))
    assert "that the verdict gives" in nothing["joint_flexibility"]


@pytest.mark.parametrize(("hold_out", "said"), [({}, True), ({"before": 0.4}, False)])
def test_a_finding_that_nothing_tested_says_so(hold_out: dict[str, float], said: bool) -> None:
    fit = {"fit": {"before": 1.0}, "hold_out": hold_out}
    assert bool(untested(replace(FOUND, fit=fit))) == said
    assert untested(replace(FOUND, fit=fit, findings=())) == ""
    assert FINDING in FOUND.findings
