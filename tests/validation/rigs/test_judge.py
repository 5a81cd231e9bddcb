"""The judge of the rig laboratory and its totals."""

from __future__ import annotations

import json

import pytest

from validation import calibrate
from validation.rigs import __main__ as command
from validation.rigs import cases, judge, totals
from validation.rigs.effects import also, place

GROUPS = {"column": [1, 2, 3, 4], "beam": [5, 6, 7, 8]}
NEAR = {"nodes": [4, 6], "elements": [4, 5, 6, 7]}


def effect(physics, location, other=(), **parameters):
    rows = [{"name": k, "value": v, "within": 0.15 * v} for k, v in parameters.items()]
    return {
        "physics": physics,
        "location": location,
        "parameters": rows,
        "near": NEAR,
        "also": list(other),
        "margin": 4.0,
        "visible": True,
    }


MASS = effect("added_mass", place([5]), [also("mass_change", place((), [4, 5]), "part")], m=1.0)
SOFT = effect("stiffness_change", place((), [5, 6], []), factor=0.6)
CLAMP = effect("grounding_spring", place([1], dof="rz"), [also("flexible_support", place([1]))])
FIXTURE = effect("flexible_support", place([1, 9]))
JOINT = effect("joint_flexibility", place([5], [5], dof="rz"))
SHEAR = effect("shear_deformation", place((), range(1, 9), ["column", "beam"]))


def finding(physics, location, confidence=0.9, equivalent=(), **parameters):
    return {
        "physics": physics,
        "location": location,
        "parameters": parameters or {"k": 1.0},
        "confidence": confidence,
        "equivalent": list(equivalent),
        "says": "…",
    }


def truth(*concealed, rig=(), besides=()):
    return {
        "accept": ["missing_physics" if concealed else "consistent"],
        "family": "portal",
        "recording": "modes",
        "findings": list(concealed),
        "rig": list(rig),
        "besides": list(besides),
        "groups": GROUPS,
        "scatter": [{"group": "column", "stiffness": 0.97, "mass": 1.01}],
        "sensors": [{"node": 3, "dof": "x", "gain": 0.985}],
    }


def said(*findings, verdict="missing_physics"):
    return {"verdict": verdict, "says": "…", "findings": list(findings)}


@pytest.mark.parametrize(
    ("found", "true", "grade"),
    [
        (finding("added_mass", place([5])), MASS, "right"),
        (finding("added_mass", place([5], dof="y")), MASS, "right"),
        (finding("added_mass", place([4])), MASS, "part"),
        (finding("added_mass", place([3])), MASS, None),
        (finding("attached_resonator", place([5])), MASS, None),
        (finding("mass_change", place((), [5])), MASS, "part"),
        (finding("mass_change", place((), [8])), MASS, None),
        (finding("stiffness_change", place((), [5, 6, 7])), SOFT, "right"),
        (finding("stiffness_change", place((), [6, 7, 8])), SOFT, "part"),
        (finding("stiffness_change", place((), [7])), SOFT, "part"),
        (finding("stiffness_change", place((), [8])), SOFT, None),
        (finding("stiffness_change", place((), (), ["beam"])), SOFT, "right"),
        (finding("stiffness_change", place((), (), ["column"])), SOFT, None),
        (finding("grounding_spring", place([1], dof="rz")), CLAMP, "right"),
        (finding("grounding_spring", place([1], dof="x")), CLAMP, None),
        (finding("flexible_support", place([1])), CLAMP, "right"),
        (finding("flexible_support", place([9])), FIXTURE, "right"),
        (finding("joint_flexibility", place([5], [4, 5])), JOINT, "right"),
        (finding("joint_flexibility", place([4], [4])), JOINT, "part"),
        (finding("joint_flexibility", place([6], [5])), JOINT, "part"),
        (finding("joint_flexibility", place((), [5])), JOINT, "right"),
        (finding("joint_flexibility", place([2], [1])), JOINT, None),
        (finding("sensor_mass", place()), effect("sensor_mass", place()), "right"),
    ],
)
def test_grades(found, true, grade):
    assert judge.graded(found, true, GROUPS) == grade


def test_what_is_true_besides_is_no_error():
    t = truth(MASS, rig=[CLAMP], besides=[SHEAR])
    row = judge.judged(
        said(
            finding("added_mass", place([5]), m=1.1),
            finding("flexible_support", place([1])),
            finding("shear_deformation", place((), (), ["beam"])),
            finding("stiffness_change", place((), (), ["column"]), factor=0.963),
            finding("sensor_fault", place([3], dof="x"), gain=0.98),
        ),
        t,
    )
    kinds = [f["status"] for f in row["findings"]]
    assert kinds == ["concealed", "rig", "besides", "scatter", "scatter"]
    assert not row["wrong_at_all"] and row["effects"][0]["size"] is True
    for untrue in (
        finding("stiffness_change", place((), (), ["column"]), factor=0.92),
        finding("stiffness_change", place((), (), ["beam"]), factor=0.97),
        finding("sensor_fault", place([3], dof="x"), gain=1.1),
        finding("axial_preload", place((), [1]), N=3.0),
    ):
        assert judge.judged(said(untrue), t)["findings"][0]["status"] == "wrong"


def test_wrong_with_and_without_confidence():
    sure, faint = (finding("viscous_damper", place([5]), c) for c in (0.5, 0.49))
    assert judge.judged(said(sure), truth(MASS))["wrong"]
    row = judge.judged(said(faint), truth(MASS))
    assert not row["wrong"] and row["wrong_at_all"]
    quiet = judge.judged(said(sure, verdict="undetermined"), truth(MASS))
    assert quiet["findings"] == [] and not quiet["wrong_at_all"]
    among = judge.judged(
        said(
            finding(
                "viscous_damper",
                place([5]),
                equivalent=[{"physics": "added_mass", "location": place([5])}],
            )
        ),
        truth(MASS),
    )
    assert among["findings"][0]["among"] and among["wrong"]


def test_two_effects_and_the_same_twice():
    t = truth(MASS, CLAMP)
    one = judge.judged(said(finding("added_mass", place([5]))), t)
    assert [e["named"] for e in one["effects"]] == ["right", None]
    again = finding("mass_change", place((), [5]), 0.6)
    both = judge.judged(said(again, finding("added_mass", place([5]), 0.4)), t)
    assert both["effects"][0]["named"] == "right" and not both["wrong"]


def raw(seed, given, true, seconds=1.0, why=""):
    times = {"seconds": seconds, "cpu": 0.5 * seconds}
    return {"seed": seed, **times, "why": why, "said": given, "truth": true}


def test_totals_by_family_and_kind():
    other = {**truth(), "family": "plate", "recording": "frf"}
    wrong = finding("viscous_damper", place([5]))
    rows = command.rows_of(
        [
            raw(1, said(finding("added_mass", place([5]), m=1.0)), truth(MASS)),
            raw(2, said(finding("added_mass", place([4]), 0.3, m=2.0)), truth(MASS)),
            raw(3, said(verdict="consistent"), truth(MASS), 9.0),
            raw(4, {}, truth({**MASS, "visible": False}), why="longer than 1 s"),
            raw(5, said(wrong), other),
            raw(6, said(verdict="consistent"), other),
        ]
    )
    s = totals.summary(rows)
    p = s["parts"]
    assert (p["all"]["cases"], p["all"]["wrong"], p["all"]["failed"]) == (6, 1, 1)
    assert p["portal"]["wrong"] == 0 and p["plate"]["false_alarms"] == 1
    assert p["plate, frf"]["nulls"] == 2 and "plate, modes" not in p
    mine = p["portal"]
    assert (mine["visible"], mine["named"], mine["right"], mine["named_and_sure"]) == (3, 2, 1, 1)
    assert (mine["sizes_right"], mine["sizes_judged"], mine["faint"]) == (1, 2, 1)
    assert mine["named_interval"] == calibrate.wilson(2, 3)
    assert s["seconds_most"] == 9.0 and s["cpu_most"] == 4.5 and s["findings"]["wrong"] == 1
    text = "\n".join(totals.say(s))
    assert "2 of 3" in text and "1 of 2 (9–91 %)" in text
    assert "WRONG" in totals.told(rows[4]) and "longer than 1 s" in totals.told(rows[3])


def test_an_evaluation_shows_totals_only(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        calibrate, "diagnose", lambda problem: said(finding("axial_preload", place()))
    )
    common = ["--count", "1", "--out", str(tmp_path)]
    assert command.main(["--seed", "5001", "--evaluation", *common]) == 0
    kept = json.loads((tmp_path / "tables" / "evaluation.json").read_text(encoding="utf-8"))
    assert "rows" not in kept and kept["parts"]["all"]["wrong"] == 1
    assert "axial_preload" not in capsys.readouterr().out
    assert command.main(["--seed", "3001", "--cases", *common]) == 0
    kept = json.loads((tmp_path / "tables" / "development.json").read_text(encoding="utf-8"))
    assert [r["seed"] for r in kept["rows"]] == [3001]
    assert "axial_preload" in capsys.readouterr().out


def test_seeds_by_family_and_kind():
    some = command.chosen(range(4000, 4030), ["portal"])
    assert some and all(cases.labels(s)[0] == "portal" for s in some)
    assert command.chosen(range(4000, 4006), ["frf"]) == [4000, 4002, 4004]
    assert command.chosen(range(4000, 4003), []) == [4000, 4001, 4002]
    drawn = cases.draw(some[0])
    assert cases.labels(some[0]) == (drawn.drawing.family, drawn.kind)


def test_a_case_keeps_what_part_each_finding_explains(tmp_path, monkeypatch):
    """By which a threshold on second findings could be drawn, without diagnosing all again."""
    finding = {"physics": "added_mass", "location": {}, "confidence": 0.5, "explains": 2e-4}
    monkeypatch.setattr(calibrate, "diagnose", lambda problem: {"findings": [finding]})
    (kept,) = command.attempt(3001, tmp_path, "", 60.0)["said"]["findings"]
    assert kept == {**finding, "equivalent": []}


def test_a_case_that_fails_has_said_nothing(tmp_path, monkeypatch):
    def broken(problem):
        raise ZeroDivisionError(f"in {problem}")

    def spin(problem):
        while True:
            pass

    monkeypatch.setattr(calibrate, "diagnose", broken)
    row = command.attempt(3001, tmp_path, "", 60.0)
    assert row["why"].startswith("ZeroDivisionError") and "/tmp" not in row["why"].split("…")[0]
    judged = command.rows_of([row])[0]
    monkeypatch.setattr(calibrate, "diagnose", spin)
    assert command.attempt(3001, tmp_path, "", 0.3)["why"] == "more than 0 s of the processor"
    assert judged["verdict"] == "" and judged["effects"][0]["named"] is None
    with pytest.raises(SystemExit):
        command.main(["--reference", "--laboratory", "tables", "--out", str(tmp_path)])
