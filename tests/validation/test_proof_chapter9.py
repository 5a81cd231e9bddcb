"""The judge of the chapter 9 cases is strict: place, parameters and error all count."""

from __future__ import annotations

from validation import proof_chapter9 as chapter9


def cross(rows, columns, n=14, m=10):
    return [
        (y - 1) * n + x
        for y in range(1, m + 1)
        for x in range(1, n + 1)
        if y in rows or x in columns
    ]


def test_a_cross_is_two_whole_middle_strips():
    truth = {"across": [7, 8], "along": [5, 6], "columns": 14}
    assert chapter9.strips(cross([5, 6], [7, 8]), truth) == (True, True)
    assert chapter9.strips(cross([5], [7]), truth) == (True, True), "one element wide"
    assert chapter9.strips(cross([5, 6], [8, 9]), truth) == (False, True), (
        "one element beside the middle"
    )
    assert chapter9.strips(cross([5, 6], []), truth) == (False, False), "one strip only"
    assert chapter9.strips(list(range(1, 141)), truth) == (False, False), (
        "the whole plate is not a cross"
    )
    assert chapter9.strips([*cross([5, 6], [7, 8]), 1], truth) == (False, False), (
        "and one element more"
    )
    assert chapter9.strips(cross([2], [7]), truth) == (False, False)


def finding(word, parameters, elements=()):
    return {
        "physics": word,
        "location": {"nodes": [], "elements": list(elements), "groups": []},
        "parameters": parameters,
        "standard_deviation": {},
        "confidence": 0.9,
        "equivalent": [],
    }


def test_a_cross_beside_the_middle_counts_only_with_the_middle_one_as_its_equivalent():
    truth = {
        "words": ["thickness_change"],
        "needed": [["thickness_change"]],
        "mean_percent": 2.3,
        "parameters": 6,
        "across": [7, 8],
        "along": [5, 6],
        "columns": 14,
    }
    beside = finding("thickness_change", {"factor": 1.5}, cross([5, 6], [8, 9]))
    said = {
        "verdict": "missing_physics",
        "says": "",
        "findings": [beside],
        "metrics": {"fit": {"frequency_error_percent_mean": {"before": 15, "after": 1.9}}},
    }
    row = chapter9.judge(said, truth)
    assert (
        row["words"]
        and row["enough"]
        and not row["place"]
        and not row["right"]
        and "beside the middle" in row["note"]
    )
    middle = {"physics": "thickness_change", "location": {"elements": cross([5, 6], [8])}}
    row = chapter9.judge({**said, "findings": [{**beside, "equivalent": [middle]}]}, truth)
    assert row["right"] and "equivalents" in row["note"]


def test_the_judge_of_chapter_9_counts_parameters_and_error():
    truth = {
        "words": ["orthotropy", "mass_proportional_damping", "stiffness_change"],
        "needed": [["orthotropy"]],
        "mean_percent": 1.0,
        "parameters": 4,
    }
    said = {
        "verdict": "missing_physics",
        "says": "",
        "findings": [
            finding("orthotropy", dict.fromkeys(("Dx", "Dy", "D1", "Dxy"), 1.1)),
            finding("mass_proportional_damping", {"alpha": 5.0}),
        ],
        "metrics": {
            "fit": {"frequency_error_percent_mean": {"before": 4.4, "after": 0.6}},
            "hold_out": {},
        },
        "time": 3.0,
    }
    row = chapter9.judge(said, truth)
    assert row["right"] and row["parameters"] == 4, "damping is no parameter of the frequencies"
    more = {**said, "findings": [*said["findings"], finding("stiffness_change", {"factor": 1.1})]}
    assert not chapter9.judge(more, truth)["right"]
    worse = {
        **said,
        "metrics": {"fit": {"frequency_error_percent_mean": {"before": 4.4, "after": 1.1}}},
    }
    assert not chapter9.judge(worse, truth)["right"]
    other = {**said, "findings": [finding("added_mass", {"m": 1.0})]}
    assert not chapter9.judge(other, truth)["right"]
