"""Cases of a seventh hand (problems/strange/seventh)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

CASES = Path(__file__).resolve().parents[2] / "problems" / "strange" / "seventh"


@pytest.mark.proof
def test_a_snubber_is_told_by_what_it_turns_in_the_shapes() -> None:
    """Light resonances and sensors 4 mm beside their nodes: the responses alone left too much, and
    the modes are explained by the usual scatter."""
    found = diagnose(CASES / "x13_pipe_snubber" / "problem.toml")
    (first,) = found.findings
    assert (first.physics, first.place.nodes, first.place.dof) == ("viscous_damper", (9,), "x")
    assert first.parameters["c"] == pytest.approx(220.0, rel=0.1)
    assert any("imaginary parts of the shapes" in line for line in found.evidence)


@pytest.mark.proof
def test_a_friction_brace_hangs_between_two_floors() -> None:
    """On a shaking table; the floors' other corners are not told from these."""
    found = diagnose(CASES / "x17_shelf_brace" / "problem.toml")
    (first,) = found.findings
    assert first.physics == "hysteresis" and first.place.dof == "x"
    assert first.place.nodes in ((4, 11), (8, 14))
    assert first.parameters["k"] == pytest.approx(30e3, rel=0.05)
    assert first.parameters["force"] == pytest.approx(12.0, rel=0.05)


@pytest.mark.proof
def test_a_table_beside_responses_tells_what_the_fitted_drive_does_not_move() -> None:
    found = diagnose(CASES / "x22_loose_post" / "problem.toml")
    feet = {f.place.dof: f.parameters["k"] for f in found.findings}
    assert feet == pytest.approx({"rx": 3e6, "ry": 3e6}, rel=0.05)


def test_mirror_images_are_never_told_apart_by_frequencies() -> None:
    """An axial mode is no partner of a bending mode that nobody gave a shape to."""
    found = diagnose(CASES / "x25_mirror_girder" / "problem.toml")
    assert all(f.confidence < 0.5 for f in found.findings)
    (first,) = found.findings
    places = {e.place.elements for e in (*first.equivalent,)} | {first.place.elements}
    assert {(4,), (9,)} <= places
