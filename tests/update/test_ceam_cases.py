"""The six case studies of thesis 6.4.1 through `run`, against what issue 6 asks of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate import study

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
STIFF = (1, 2, 3, 5, 7, 8, 9, 14, 19, 20)
TRUE = np.array([1 / 1.08 - 1 if i in STIFF else 0.0 for i in range(1, 21)])


def run(case, name="problem.toml"):
    updated = study.run(PROBLEMS / f"ceam/case{case}" / name)
    assert updated.status == "converged"
    assert updated.model["mass_eigenvalue_min"] > 0
    assert updated.model["stiffness_eigenvalue_min"] > -1e-10
    return updated, {
        of: np.array([q.p for q in updated.parameters if q.of == of])
        for of in ("stiffness", "mass", "damping")
    }


def halved(updated):
    error = updated.fit["hold_out"]["frf_error"]
    return error["after"] <= 0.5 * error["before"]


@pytest.mark.slow
def test_case_1_is_exact():
    updated, p = run(1)
    assert p["stiffness"] == pytest.approx(TRUE, abs=1e-6)
    assert p["mass"] == pytest.approx(np.zeros(20), abs=1e-6)
    assert updated.certificate["optimal"]
    assert updated.fit["hold_out"]["frf_error"]["after"] < 1e-6


@pytest.mark.slow
def test_case_2_is_exact_with_loss_that_is_not_proportional():
    _, p = run(2)
    lossy = np.arange(1, 21) % 2 == 1
    assert p["stiffness"] == pytest.approx(TRUE, abs=1e-6)
    assert p["mass"] == pytest.approx(np.zeros(20), abs=1e-6)
    assert p["damping"] == pytest.approx((1 + TRUE) * lossy - 1, abs=1e-6)


@pytest.mark.slow
def test_case_3_halves_the_error_and_ranks_the_ten_wrong_elements_first():
    updated, p = run(3)
    assert halved(updated)
    assert np.all(np.abs(p["stiffness"]) <= 0.2 + 1e-9)
    assert set(np.argsort(p["stiffness"])[:10] + 1) == set(STIFF)


@pytest.mark.slow
def test_case_4_needs_twenty_modes_only():
    _, p = run(4)
    assert p["stiffness"] == pytest.approx(TRUE, abs=1e-6)
    assert p["mass"] == pytest.approx(np.zeros(20), abs=1e-6)


@pytest.mark.slow
def test_case_5_halves_the_error_and_keeps_the_mass_definite():
    updated, _ = run(5)
    assert halved(updated)
    assert any(
        "mass matrix stays positive definite" in clause for clause in updated.model["clauses"]
    )
    assert updated.certificate["primal_cone"] < 1e-8


@pytest.mark.slow
def test_case_6_converges_and_improves_mode_1_too():
    updated, _ = run(6)
    assert halved(updated)
    assert updated.modes[0].error_after < 0.5 * updated.modes[0].error_before
