"""Cases of an eleventh hand (problems/strange/eleventh): tables of modes of structures whose rig
gives in every direction, beside a reference."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

ELEVENTH = Path(__file__).resolve().parents[2] / "problems" / "strange" / "eleventh"


@pytest.mark.proof
def test_a_joint_of_a_table_on_feet_that_give_in_every_direction() -> None:
    """The time was over before the reference was met."""
    (first,) = diagnose(ELEVENTH / "a02_table_frame_joint" / "problem.toml").findings
    assert first.physics == "joint_flexibility" and first.confidence >= 0.5
    assert (first.place.nodes, first.place.elements) == ((14,), (16,))


@pytest.mark.slow
def test_a_prop_under_a_frame_on_soil() -> None:
    (first, *rest) = diagnose(ELEVENTH / "a09_frame_on_soil_prop" / "problem.toml").findings
    assert (first.physics, first.place.nodes, first.place.dof) == ("grounding_spring", (17,), "z")
    assert first.parameters["k"] == pytest.approx(8.0e6, rel=0.1) and not rest


@pytest.mark.slow
def test_close_modes_that_were_mixed_the_other_way_round_are_no_change() -> None:
    found = diagnose(ELEVENTH / "a14_nothing_changed" / "problem.toml")
    assert found.verdict == "consistent"


@pytest.mark.proof
def test_a_support_that_stands_elsewhere() -> None:
    """Where nothing is left of it the model's support gives way, be it with a mass of its own: both
    words say that, and each is told as the other's equivalent."""
    found = diagnose(ELEVENTH / "a16_prop_moved" / "problem.toml").findings
    told = {
        f.place.nodes: f for f in found if f.physics in ("grounding_spring", "flexible_support")
    }
    assert told[10,].physics == "grounding_spring" and told[10,].parameters["k"] > 1e8
    gone = {told[9,].physics, *(e.physics for e in told[9,].equivalent if e.place.nodes == (9,))}
    assert "grounding_spring" in gone
