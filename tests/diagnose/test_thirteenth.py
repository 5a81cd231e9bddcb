"""Cases of a thirteenth hand (problems/strange/thirteenth): rigs that are less polite."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

CASES = Path(__file__).resolve().parents[2] / "problems" / "strange" / "thirteenth"


@pytest.mark.proof
def test_a_damper_on_a_rail_whose_stands_differ() -> None:
    """Stands of 4, 6 and 5 MN/m; "element 1 is 51 % softer" and three more that are not (0.93 to
    0.99)."""
    found = {f.physics: f for f in diagnose(CASES / "c19_rail" / "problem.toml").findings}
    assert {"grounding_spring", "viscous_damper"} <= set(found)
    assert set(found) <= {"grounding_spring", "viscous_damper", "sensor_mass"}, "of 30 g each"
    damper, stands = found["viscous_damper"], found["grounding_spring"]
    assert damper.place.nodes == (6,) and damper.parameters["c"] == pytest.approx(130.0, rel=0.15)
    assert stands.place.nodes == (1, 10, 17)
    assert stands.parameters["k"] == pytest.approx(5e6, rel=0.15)


@pytest.mark.proof
def test_nothing_stands_for_bearings_that_differ() -> None:
    """Of 120 to 250 MN/m; "437 kg at node 1" and "element 20 is 87 % heavier" (0.99)."""
    found = {f.physics: f for f in diagnose(CASES / "c04_footbridge" / "problem.toml").findings}
    assert set(found) == {"grounding_spring", "shear_deformation"}
    assert found["grounding_spring"].place.nodes == (1, 7, 15, 21)


@pytest.mark.proof
def test_a_tip_weight_is_a_body() -> None:
    """Drawn as a point; "76 g swing on their own at node 11" (0.98)."""
    said = diagnose(CASES / "c00_tip_weight" / "problem.toml")
    assert {f.place.nodes for f in said.findings} == {(1,)}, "the clamp alone"
