"""Cases of the motion laboratory: what comes up, files that the package accepts, grades."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from typer.testing import CliRunner

from cvxupdate.cli import app
from validation.motions import __main__ as laboratory
from validation.motions import cases, drives, effects
from validation.motions.files import make
from validation.rigs.drawing import TRANSLATIONS
from validation.rigs.judge import judged


def test_a_sixth_drifts_a_third_is_linear_or_null():
    drawn = [cases.draw(s) for s in range(12)]
    for case in drawn:
        kind = cases.KINDS[case.seed % 6]
        assert bool(case.moving) == (kind == "drift")
        assert bool(case.laws) == (kind == "law")
        assert len(case.truths) >= (kind in ("law", "linear"))
        assert (case.what == kind) != (kind == "law")
        assert [r.use for r in case.runs].count("hold-out") == 1
        levels = [r.level for r in case.runs]
        assert levels[-1] <= max(levels[:-1]) and min(levels) == 1.0
        for law, b in case.laws:
            assert law.p and np.any(b)
        if case.moving:
            assert any(r.start or r.end for r in case.runs)


def test_every_law_has_its_size_from_its_place():
    d = cases.draw(0).plain.drawing
    spot = effects.Spot((2,), "x", 1e-3, 0.2, 1e5)
    for name, maker in effects.MAKERS.items():
        law, truth = maker(np.random.default_rng(1), d, spot)
        reach = 1e-3 if law.kind != "gap" or law.p[2] > 0 else -1e-3
        z = law.p[1] if law.remembers else 0.0
        force = abs(law.force(reach, 0.2, z))
        assert 0.005 * 1e5 * 1e-3 < force < 6.0 * 1e5 * 1e-3, name
        assert truth.location["nodes"] == [2] and truth.physics in effects.WORDS


def test_a_problem_passes_check_and_is_the_same_again(tmp_path):
    case = make(24, tmp_path / "a")  # marched in short time
    make(24, tmp_path / "b")
    given = CliRunner().invoke(app, ["check", str(tmp_path / "a" / "problem.toml")])
    assert given.exit_code == 0 and "in order" in given.output
    first, second = (sorted((tmp_path / n).iterdir()) for n in "ab")
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]
    truth = tomllib.loads((tmp_path / "a" / "truth.toml").read_text(encoding="utf-8"))
    assert truth["accept"] == ["consistent"] and not truth["drift"]
    data = np.load(tmp_path / "a" / "run1.npz")["data"]
    assert data.shape == (case.drive.samples, 1 + len(case.plain.sensors))
    # from rest: what comes before the force is noise
    assert np.std(data[:24], axis=0) == pytest.approx(np.zeros(data.shape[1]), abs=0.1 * data.std())
    assert {k for _, k in case.plain.sensors} <= set(TRANSLATIONS)


def test_what_a_simulation_writes_sets_in_at_once():
    """At full strength with the first sample, all else as in a record of the same kind."""
    kinds = {s: cases.draw(s) for s in range(506, 512)}
    sudden = [c for c in kinds.values() if c.drive.kind != "hammer"]
    assert sudden and all(c.drive.sudden for c in sudden)
    for c in sudden:
        force = c.drive.recorded(c.runs[0].force)
        early = np.std(force[:30]) / np.std(force)
        assert force.shape == (c.drive.samples,) and 0.2 < early < 5.0
        assert np.array_equal(force, c.runs[0].force[:: drives.FINER])


def finding(physics, nodes, dof="x"):
    where = {"nodes": nodes, "elements": [], "groups": [], "dof": dof}
    return {
        "physics": physics,
        "location": where,
        "parameters": {"force": 1.1},
        "confidence": 0.9,
        "says": "",
    }


@pytest.mark.parametrize(
    ("found", "grade"),
    [
        (finding("dry_friction", [2, 3]), "right"),
        (finding("hysteresis", [2, 3]), "right"),
        (finding("dry_friction", [3]), "part"),
        (finding("viscous_damper", [3, 2]), "part"),
        (finding("dry_friction", [4]), "part"),
        (finding("dry_friction", [6]), None),
        (finding("dry_friction", [2, 3], "y"), None),
        (finding("clearance", [2, 3]), None),
    ],
)
def test_what_is_between_two_nodes_is_not_told_by_one(found, grade):
    spot = effects.Spot((2, 3), "x", 1e-3, 0.2, 1e5)
    d = cases.draw(0).plain.drawing
    _, truth = effects.friction(np.random.default_rng(1), d, spot)
    row = {
        "physics": truth.physics,
        "location": truth.location,
        "near": truth.near,
        "also": truth.also,
        "parameters": [],
        "visible": True,
        "margin": 3.0,
    }
    assert effects.graded(found, row, {}) == grade
    said = {"verdict": "missing_physics", "findings": [found]}
    whole = {"family": "chain", "recording": "friction", "accept": [], "findings": [row]}
    result = judged(said, whole, effects.graded)
    assert result["wrong"] == (grade is None)
    assert result["effects"][0]["named"] == grade


def test_seeds_of_the_evaluation_are_not_shown(tmp_path, capsys):
    for option in ("--cases", "--generate"):
        with pytest.raises(SystemExit) as left:
            laboratory.main(["--seed", "1003", "--count", "1", option, "--out", str(tmp_path)])
        assert left.value.code == 2 and "evaluation" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_drift_is_counted_by_what_is_said():
    rows = [
        {"truth": {"drift": True}, "said": {"says": "", "evidence": ["… follows the clock …"]}},
        {"truth": {"drift": True}, "said": {"says": "Nothing.", "evidence": []}},
        {"truth": {"drift": False}, "said": {}},
    ]
    text = laboratory.drifts(rows)
    assert "1 of 2" in text and "0 of 1" in text
