"""The studies of 7.7 reach what docs/generic-elements.md says of them."""

from pathlib import Path

import pytest

from cvxupdate.study import run

PROBLEMS = Path(__file__).resolve().parents[2] / "problems" / "generic"


def test_a_wrong_section_is_found_exactly() -> None:
    """7.7.2A: the true matrices are members of the family, so nothing is left, mass included."""
    found = run(PROBLEMS / "beam_a" / "problem.toml")
    assert found.status == "converged" and found.iterations <= 4
    assert found.fit["hold_out"]["frf_error"]["after"] < 1e-5
    assert found.model["mass_after"] == pytest.approx(4.71, rel=1e-5)


def test_the_error_of_a_mesh_is_taken_up_by_a_family_and_not_by_p_values() -> None:
    """7.7.2B, another drive held out: at least ten times better than the p-values."""
    errors = {
        name: run(PROBLEMS / "beam_b" / f"{name}.toml").fit["hold_out"]["frf_error"]
        for name in ("problem", "p_values")
    }
    assert errors["problem"]["after"] < 0.02 < errors["problem"]["before"]
    assert errors["p_values"]["after"] > 10.0 * errors["problem"]["after"]


def test_the_mesh_of_a_plate_is_mended_in_the_iterations_of_the_source() -> None:
    """7.7.3B: ten times better than p-values (0.27, docs/generic-elements.md) on another drive."""
    found = run(PROBLEMS / "plate_b" / "problem.toml")
    assert found.status == "converged" and found.iterations <= 5
    assert found.fit["hold_out"]["frf_error"]["after"] < 0.027


def test_errors_of_single_elements_of_a_plate_are_found_with_a_prior() -> None:
    """7.7.3A: 189 unknowns, more than the recordings determine."""
    found = run(PROBLEMS / "plate_a" / "problem.toml")
    assert found.status == "converged" and found.iterations <= 4
    assert found.fit["hold_out"]["frf_error"]["after"] < 0.01
    assert len(found.undetermined) > 50
    assert found.model["mass_after"] == pytest.approx(0.1755, rel=1e-3)
