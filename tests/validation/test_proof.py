"""The judge of `make proof` is strict: a wrong verdict, effect, place, or one sentence too many is
not right."""

from __future__ import annotations

from copy import deepcopy

import pytest

from validation import proof


def place(nodes=(), elements=(), groups=(), dof=None):
    return {
        "nodes": list(nodes),
        "elements": list(elements),
        "groups": list(groups),
        **({"dof": dof} if dof else {}),
    }


TRUTH = {
    "verdict": "missing_physics",
    "accept": ["missing_physics"],
    "findings": [
        {
            "physics": "viscous_damper",
            "location": place([2, 3], dof="x"),
            "accept": {},
            "equivalent": [{"physics": "structural_damping", "location": place((), [103])}],
            "parameters": [
                {
                    "name": "c",
                    "value": 9.0,
                    "tolerance": 0.25,
                    "aliases": ["damping"],
                    "required": True,
                }
            ],
        }
    ],
}
FINDING = {
    "physics": "viscous_damper",
    "location": place([2, 3], dof="x"),
    "parameters": {"c": 8.9},
    "confidence": 0.9,
}
SAID = {
    "verdict": "missing_physics",
    "says": "…",
    "findings": [FINDING],
    "fit": {"hold_out": {"before": 0.4, "after": 0.02}},
    "time": 9.0,
}


def said(**changes):
    return {**deepcopy(SAID), **changes}


def test_right_is_right():
    row = proof.judge(said(), TRUTH)
    assert (
        row["right"]
        and row["physics"]
        and row["place"]
        and row["size"]
        and row["halved"]
        and row["quick"]
        and not row["equivalent"]
    )


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"verdict": "parameter_error"}, "right_verdict"),
        ({"verdict": "undetermined", "findings": []}, "physics"),
        ({"findings": [{**FINDING, "physics": "mass_proportional_damping"}]}, "physics"),
        ({"findings": [{**FINDING, "location": place([3, 4], dof="x")}]}, "place"),
        ({"findings": [{**FINDING, "location": place([2, 3], dof="y")}]}, "place"),
        ({"fit": {"hold_out": {"before": 0.4, "after": 0.3}}}, "halved"),
    ],
)
def test_wrong_is_wrong(changes, what):
    row = proof.judge(said(**changes), TRUTH)
    assert not row["right"] and not row[what]


def test_size_time_and_spurious_findings():
    assert not proof.judge(said(findings=[{**FINDING, "parameters": {"c": 15.0}}]), TRUTH)["size"]
    assert not proof.judge(said(time=61.0), TRUTH)["quick"]
    two = proof.judge(
        said(findings=[FINDING, {**FINDING, "physics": "added_mass", "location": place([1])}]),
        TRUTH,
    )
    assert two["spurious"] and not two["right"]


def test_equivalents_count_at_their_own_place_only():
    other = {
        "physics": "structural_damping",
        "location": place((), [103]),
        "parameters": {"eta": 0.1},
        "confidence": 0.8,
    }
    row = proof.judge(said(findings=[other]), TRUTH)
    assert row["right"] and row["equivalent"] and not row["size"]
    assert not proof.judge(said(findings=[{**other, "location": place((), [101])}]), TRUTH)["right"]


def test_neighbours_that_truth_accepts():
    truth = {"nodes": [], "elements": [8, 9], "groups": ["bar"]}
    accept = {"elements": [7, 8, 9, 10]}
    assert proof.right_place(place((), [8, 9, 10]), truth, accept)
    assert not proof.right_place(place((), [1, 2, 3]), truth, accept)
    assert not proof.right_place(place((), range(1, 17), ["bar"]), truth, accept), (
        "the whole bar is not two of its elements"
    )


def test_nothing_and_nonlinear():
    null = {"verdict": "consistent", "accept": ["consistent", "parameter_error"], "findings": []}
    assert proof.judge(said(verdict="consistent", findings=[]), null)["right"]
    assert not proof.judge(said(), null)["right"]
    stop = {
        "verdict": "missing_physics",
        "accept": ["missing_physics"],
        "findings": [{"physics": "clearance", "location": place([2, 3])}],
    }
    silent = proof.judge(said(verdict="undetermined", findings=[]), stop)
    assert not silent["right"] and not silent["linear_sentence"]
    linear = proof.judge(said(), stop)
    assert not linear["right"] and linear["linear_sentence"]
    assert not proof.judge(said(verdict="consistent", findings=[]), stop)["right"]
