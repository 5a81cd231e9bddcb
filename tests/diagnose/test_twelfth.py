"""Cases of a twelfth hand (problems/strange/twelfth)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

CASES = Path(__file__).resolve().parents[2] / "problems" / "strange" / "twelfth"


@pytest.mark.proof
def test_a_joint_on_feet_that_turn() -> None:
    found = {f.physics: f for f in diagnose(CASES / "m03_frame_joint" / "problem.toml").findings}
    joint, feet = found["joint_flexibility"], found["grounding_spring"]
    assert (joint.place.nodes, joint.place.elements) == ((22,), (36,))
    assert joint.parameters["k"] == pytest.approx(45e3, rel=0.1)
    assert feet.place.nodes == (1, 14) and feet.parameters["k"] == pytest.approx(6e5, rel=0.1)


@pytest.mark.proof
def test_what_a_shaker_brings_from_place_to_place() -> None:
    """A free bar that has nothing but a rig: armature at the drive of each recording, sensors, and
    one recording whose force channel reads low."""
    diagnosis = diagnose(CASES / "h04_free_bar_rig" / "problem.toml")
    found = {f.physics: f for f in diagnosis.findings}
    assert set(found) == {"added_mass", "sensor_mass", "sensor_fault"}
    assert found["added_mass"].parameters["m"] == pytest.approx(0.035, rel=0.05)
    assert found["sensor_mass"].parameters["m"] == pytest.approx(0.006, rel=0.05)
    fault = found["sensor_fault"]
    assert fault.place.nodes == (9,) and fault.parameters["gain"] == pytest.approx(0.88, rel=0.01)
    assert "and wherever else the drive is" in diagnosis.says
