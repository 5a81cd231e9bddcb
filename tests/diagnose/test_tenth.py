"""Cases of an eighth and a tenth hand (problems/strange/eighth, tenth): what changed since the
reference state, and what a structure has not."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.study import diagnose

STRANGE = Path(__file__).resolve().parents[2] / "problems" / "strange"


def test_a_clamp_that_turned_has_come_looser() -> None:
    (first,) = diagnose(STRANGE / "tenth" / "a01_looser_clamp" / "problem.toml").findings
    assert (first.physics, first.place.nodes, first.place.dof) == ("grounding_spring", (1,), "ry")
    assert first.parameters["k"] == pytest.approx(2500.0, rel=0.15)


def test_a_strong_damper_on_a_floor_that_moves_as_one() -> None:
    """Frequencies move, too, for it couples modes; which of the floor's nodes nothing tells."""
    (first,) = diagnose(STRANGE / "tenth" / "a03_frame_damper" / "problem.toml").findings
    assert first.physics == "viscous_damper" and first.place.dof == "x"
    assert 7 in {*first.place.nodes, *(e.place.nodes[0] for e in first.equivalent)}
    assert first.parameters["c"] == pytest.approx(260.0, rel=0.1)
    assert "which of them is hardly told" in first.says


@pytest.mark.proof
def test_a_brace_that_is_not_there() -> None:
    (first,) = diagnose(STRANGE / "tenth" / "a06_missing_brace" / "problem.toml").findings
    assert first.physics == "stiffness_change" and first.place.elements == (24, 25, 26)
    assert first.parameters["factor"] < 0.1 and first.confidence > 0.9


@pytest.mark.proof
def test_a_loose_span_of_an_edge_that_turned_before() -> None:
    """It was "a hidden oscillator and thinner elements" (0.99)."""
    (first,) = diagnose(STRANGE / "eighth" / "y07_loose_span" / "problem.toml").findings
    assert first.physics == "grounding_spring" and first.place.nodes == (46, 55)
