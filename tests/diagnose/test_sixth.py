"""Cases of a sixth hand (problems/strange/sixth)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

CASES = Path(__file__).resolve().parents[2] / "problems" / "strange" / "sixth"


def test_a_mode_that_a_shear_chain_cannot_have_is_left_out() -> None:
    """A torsional one, whose shape along x is nearer to the first mode than to any that nobody
    measured; it was told as ten tonnes on a spring, with 0.99."""
    found = diagnose(CASES / "w14_storeys_torsion" / "problem.toml")
    assert found.verdict == "consistent" and not found.findings
    assert "mode at 3.91 Hz was left out: its shape is that of no further mode" in found.says


@pytest.mark.proof
def test_backlash_of_a_drive_is_found() -> None:
    """A torsion chain: laws about an axis, where springs are."""
    found = diagnose(CASES / "w21_drive_backlash" / "problem.toml")
    (first,) = found.findings
    assert (first.physics, first.place.nodes, first.place.dof) == ("clearance", (3, 4), "rx")
    assert first.parameters["gap"] == pytest.approx(1.5e-3, rel=0.1)
    assert first.parameters["k"] == pytest.approx(16e3, rel=0.1)
    assert "rad, in either direction" in found.says and "N·m/rad" in found.says


@pytest.mark.slow
def test_an_edge_that_is_riveted_is_found() -> None:
    """A sheet hinged on all sides in the model, coarse; what is held out has no shapes, and is
    found again by frequency: two modes stand 1.2 and 1.8 % to either side of one of them."""
    found = diagnose(CASES / "w15_riveted_edge" / "problem.toml")
    (first,) = found.findings
    assert first.physics == "grounding_spring" and first.place.nodes == tuple(range(1, 10))
    assert first.place.dof == "rx" and first.parameters["k"] == pytest.approx(112.5, rel=0.1)
    assert "turns against springs of" in found.says
    assert found.fit["hold_out"]["after"] < 0.25 * found.fit["hold_out"]["before"]
