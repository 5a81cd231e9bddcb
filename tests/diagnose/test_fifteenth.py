"""Cases of a fifteenth hand (problems/strange/fifteenth): one that is not like the others, sensors
across their axes, a fixture that is soft in every direction."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

CASES = Path(__file__).resolve().parents[2] / "problems" / "strange" / "fifteenth"


@pytest.mark.proof
def test_one_of_four_stands_is_a_fifth_as_stiff() -> None:
    """ "Each of the 4 supports holds with 28.0 MN/m" (0.99): three of 28 to 33, and 6 MN/m."""
    found = diagnose(CASES / "f09_stands" / "problem.toml").findings
    stands = {f.place.nodes: f for f in found if f.physics == "grounding_spring"}
    assert set(stands) == {(3,), (1, 2, 4)}
    assert stands[3,].parameters["k"] == pytest.approx(6e6, rel=0.1)
    assert stands[1, 2, 4].parameters["k"] == pytest.approx(30e6, rel=0.1)


@pytest.mark.proof
def test_a_weak_piece_of_a_ladder_whose_sensors_are_turned() -> None:
    """Without an answer: a force along y moves ten sensors along z by what they are turned."""
    found = {f.physics: f for f in diagnose(CASES / "f05_ladder" / "problem.toml").findings}
    weak = found["stiffness_change"]
    assert weak.place.elements == (14, 15)
    assert weak.parameters["factor"] == pytest.approx(0.7, rel=0.05)
    assert set(found) <= {"stiffness_change", "sensor_mass", "shear_deformation"}
