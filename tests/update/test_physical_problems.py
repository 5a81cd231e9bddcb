"""The problem files of chapter 8 through `run`: Tables 8.1 and 8.2, and what stays open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cvxupdate
from cvxupdate.update.result import Updated
from validation import make_physical as made

PROBLEMS = Path(__file__).resolve().parents[2] / "problems" / "physical"


def run(name: str) -> tuple[Updated, np.ndarray]:
    updated = cvxupdate.run(PROBLEMS / f"{name}.toml")
    return updated, np.array([q.p for q in updated.parameters])


def test_fe2_in_four_iterations() -> None:
    """8.3: eight elements with I 30 % high, all coordinates, the nine printed frequencies."""
    updated, p = run("beam/problem")
    truth = np.zeros(20)
    truth[[e - 1 for e in made.bay.THICK]] = 1 / 1.3 - 1
    assert updated.status == "converged" and updated.iterations <= 4
    assert np.abs(p - truth).max() < 1e-8


def test_four_macro_elements() -> None:
    """Table 8.1, first row: the thesis found 14.91, 8.1, 9.6 and 10.8 %."""
    updated, p = run("plate/macros")
    assert updated.status == "converged"
    assert np.allclose(1 / (1 + p) - 1, [0.15, 0.08, 0.10, 0.12], atol=1e-8)
    assert updated.undetermined == ()


@pytest.mark.slow
def test_single_elements_and_the_one_that_cannot_be_told() -> None:
    """Table 8.1, second row. Element 1 is in three of the four macro elements, and of its h, E and
    rho recordings see E h³ and rho h only: that is said, and the rest is found."""
    updated, p = run("plate/singles")
    (silent,) = updated.undetermined
    assert {name for name, _ in dict(silent["coefficients"]).items()} == {
        "e1.thickness",
        "e1.E",
        "e1.rho",
    }
    assert str(silent["says"]).startswith("e1.thickness × t, e1.E ÷ t³ and e1.rho ÷ t change no")
    assert silent["standard_deviation"] is None
    truth = {f"e{e}.{of}": 1 / f - 1 for of, (f, some) in made.PLATE_ERRORS.items() for e in some}
    for q, value in zip(updated.parameters, p.tolist(), strict=True):
        if q.name not in ("e1.thickness", "e1.E", "e1.rho"):
            assert value == pytest.approx(truth[q.name], abs=1e-6), q.name


@pytest.mark.slow
def test_table_8_2() -> None:
    """8.7: exact elements, all coordinates, the eight printed frequencies (230.5 Hz)."""
    updated, p = run("exact/problem")
    truth = np.concatenate([made.truth(made.EXACT_ERRORS, of, 20) for of in made.EXACT_ERRORS])
    assert updated.status == "converged" and updated.iterations <= 6
    assert np.abs(p - truth).max() < 1e-8
