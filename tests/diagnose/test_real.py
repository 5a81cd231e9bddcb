"""Real recordings: what diagnose says of them, where CVXUPDATE_DATA names their folder."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

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
@pytest.mark.parametrize(("place", "millimetres"), [(3, 110.8), (6, 185.4)])
def test_the_roller_is_found_where_the_sensor_says(place, millimetres):
    """Places on the straight line of the sensor through all six rests; the roller comes first."""
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


@needs("beam-six-masses-frf")
@pytest.mark.slow
def test_beside_the_healthy_state_it_is_named_among_all_that_may_be(tmp_path):
    """Nothing calibrated: two of seventy layouts, all words."""
    from cvxupdate.study import diagnose
    from validation.real.reference import problem

    f, positions = diagnoses.make.layouts()
    for k in (5, 39):
        (first,) = diagnose(problem(tmp_path, k, f[:, k], positions[k], False)).findings
        _, at = diagnoses.make.beam_mesh(positions[k])
        assert first.physics == "added_mass" and first.place.nodes == (at[0],)
        assert first.parameters["m"] < 0.0 and first.confidence > 0.5


@pytest.mark.slow
@needs("dropbear-moving-support")
def test_six_rests_of_the_roller_are_one_stiffness_on_a_straight_line():
    """The line of the position sensor, whose volts no problem file has."""
    from cvxupdate.study import diagnose

    folder = PROBLEMS / "real" / "dropbear-moving-support"
    said = diagnose(folder / "problem_diagnose_rests.toml")
    assert {f.physics for f in said.findings} == {"grounding_spring"}
    volts = tomllib.loads((PROBLEMS / "real" / "truth.toml").read_text(encoding="utf-8"))
    volts = volts["roller"]["volts"]
    x = np.array([f.parameters["x"] for f in said.findings])
    off = x - np.polyval(np.polyfit(volts, x, 1), volts)
    assert np.sqrt(np.mean(off**2)) < 0.002
