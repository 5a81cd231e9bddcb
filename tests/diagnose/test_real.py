"""Real recordings: what diagnose says of them, where CVXUPDATE_DATA names their folder; and the
judge and the makers of problem files without them."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from validation import proof_chapter9 as chapter9
from validation.real import diagnoses

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"


def present(name: str) -> bool:
    root = os.environ.get("CVXUPDATE_DATA")
    return root is not None and (Path(root) / name).is_dir()


def needs(name: str):
    """Skip by name where a data set is absent."""
    return pytest.mark.skipif(
        not present(name), reason=f"the data set {name} is not under CVXUPDATE_DATA"
    )


# what needs no recordings


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


def test_a_place_between_nodes_is_the_vertex_of_the_misfit():
    misfit = [(x, 1e7, 3.0 + ((x - 0.1142) / 0.002) ** 2) for x in (0.111, 0.114, 0.117)]
    assert diagnoses.between_nodes(misfit) == pytest.approx(0.1142, abs=1e-9)
    assert diagnoses.between_nodes(misfit[:2]) == 0.114, "without both neighbours the node itself"


def test_one_place_that_is_off_does_not_bend_the_line():
    v = np.array([1.2, 1.6, 2.1, 2.5, 2.9, 3.4])
    x = 0.0563 * v - 0.01
    x[0] += 0.03
    slope, offset = diagnoses.robust_line(v, x)
    assert slope == pytest.approx(0.0563, rel=0.02) and offset == pytest.approx(-0.01, abs=2e-3)


def test_masses_of_the_beam_stand_at_their_printed_places():
    positions = np.array([0.0274, 0.1010, 0.1595, 0.2041, 0.2352, 0.3018])
    xs, at = diagnoses.make.beam_mesh(positions)
    assert np.all(np.diff(xs) > 0) and xs[[n - 1 for n in at]] == pytest.approx(positions)


def test_truths_are_in_no_problem_file():
    """The tool's files say nothing of the sensor's volts, of weighed masses or of the place of the
    loss."""
    for file in (PROBLEMS / "real").glob("*/problem_diagnose_*.toml"):
        own = file.read_text(encoding="utf-8")
        include = tomllib.loads(own)["model"].get("include")
        text = own + ((file.parent / include).read_text(encoding="utf-8") if include else "")
        for secret in ("1.437", "0.270", "0.128", "volt", " V:", "strip welded", "L1"):
            assert secret not in text, f"{file.name}: {secret}"


# with the recordings


@needs("cristallo-3storey-frame")
def test_the_frame_tested_again_is_consistent():
    from cvxupdate.study import diagnose

    for k in (2, 3):
        said = diagnose(
            PROBLEMS / "real" / "cristallo-3storey-frame" / f"problem_diagnose_test_{k}.toml"
        )
        assert said.verdict == "consistent" and not said.findings
        assert said.fit["hold_out"]["after"] < 1e-3


@needs("cristallo-3storey-frame")
def test_clamped_legs_get_no_confident_wrong_sentence():
    from cvxupdate.study import diagnose

    said = diagnose(PROBLEMS / "real" / "cristallo-3storey-frame" / "problem_diagnose_clamped.toml")
    assert said.verdict in ("undetermined", "parameter_error")
    assert not any(f.physics == "added_mass" and f.confidence > 0.5 for f in said.findings), (
        "the floors are weighed"
    )


@pytest.mark.slow
@needs("dropbear-moving-support")
@pytest.mark.parametrize(("place", "millimetres"), [(3, 110.8), (4, 135.0), (6, 185.4)])
def test_the_roller_is_found_where_the_sensor_says(place, millimetres):
    """Places on the straight line of the sensor through all six rests; the roller is the word that
    comes first."""
    from cvxupdate.study import diagnose

    said = diagnose(
        PROBLEMS / "real" / "dropbear-moving-support" / f"problem_diagnose_place_{place}.toml"
    ).to_json()
    assert said["verdict"] == "missing_physics" and diagnoses.roller_named(said)
    node = said["findings"][0]["location"]["nodes"][0]
    assert abs(3.0 * (node - 1) - millimetres) <= 3.5  # nodes are 3 mm apart
    assert said["fit"]["hold_out"]["after"] < 0.02 * said["fit"]["hold_out"]["before"]


@pytest.mark.slow
@needs("beam-six-masses-frf")
def test_the_mass_that_went_is_the_one_next_to_the_clamp(tmp_path):
    """Three of seventy layouts: calibrated on the healthy medians, diagnosed from five
    frequencies."""
    from cvxupdate.study import diagnose, run

    values = {
        q.name: q.after
        for q in run(
            PROBLEMS / "real" / "beam-six-masses-frf" / "problem_calibrate.toml"
        ).parameters
    }
    clamp = diagnoses.make.Clamp(values["clamp z.k"], values["clamp ry.k"], values["clamp mass.m"])
    f, positions = diagnoses.make.layouts()
    for k in (7, 28, 56):
        healthy = diagnoses.frequencies(
            diagnoses.make.beam("asked", positions[k], clamp, diagnoses.ASKED), folder=tmp_path
        )
        path = tmp_path / f"layout_{k}.toml"
        path.write_text(
            diagnoses.make.damaged(
                k, clamp, f[1, k] * healthy / f[0, k], positions[k], ("added_mass",)
            ),
            encoding="utf-8",
        )
        said = diagnose(path).to_json()
        (first,) = said["findings"][:1]
        _, at = diagnoses.make.beam_mesh(positions[k])
        assert first["location"]["nodes"] == [at[0]] and first["parameters"]["m"] < 0
        assert said["fit"]["fit"]["after"] < 0.5 * said["fit"]["fit"]["before"]
