"""Real structures by exact members and by meshes: docs/exact-elements.md."""

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import read_text
from cvxupdate.study import run
from validation.exact_real import ROLLER, Row, meshed, of_roller, of_six
from validation.generic_real import figures, percent


def model_of(row: Row):
    return build_model(read_text(row.text, row.path))


def test_the_mesh_of_the_roller_comes_near_to_the_exact_members() -> None:
    """The same structure: six rests, frequencies from above, a sixteenth of the error for half the
    length."""
    exact, *meshes = of_roller()[:4]
    true = model_modes(model_of(exact), 12).frequencies
    errors = [np.max(model_modes(model_of(m), 12).frequencies / true - 1.0) for m in meshes]
    assert [model_of(m).size for m in (exact, *meshes)] == [24, 36, 72, 144]
    assert errors[0] > 8.0 * errors[1] > 0.0
    assert errors[2] == pytest.approx(0.0, abs=2e-3)  # beams that do not shear


def test_one_modulus_and_one_support_foresee_other_rests() -> None:
    """Two numbers of exact members, after the first step; a modulus for each beam of a mesh are 37,
    which foresee worse (docs/exact-elements.md)."""
    rows = {row.name: row for row in of_roller()}
    one_step = rows["exact: E, roller"].text.replace("[update]\n", "[update]\nmax_iterations = 1\n")
    updated = run(read_text(one_step, ROLLER))
    fit = figures(updated)
    before, after = (percent(fit, "hold_out", when) for when in ("before", "after"))
    assert len(updated.parameters) == 2 and after < 0.75 * before
    many = {name: len(model_of(row).parameters) for name, row in rows.items()}
    assert many["6 beams: E of each, roller"] == 37 and many["exact: E of each, roller"] == 13


def test_every_clamp_is_a_problem_of_its_own() -> None:
    rows = of_six()
    assert len({row.text for row in rows}) == len(rows) == 12
    sizes = {row.name: model_of(row).size for row in rows}
    assert sizes["exact: E, rotation"] == 15 and sizes["mesh: E, rotation"] == 39
    assert sizes["exact: spring, rotation, mass"] == 16
    count = {row.name: len(model_of(row).parameters) for row in rows}
    assert count["exact: E of each element, rotation"] == 8
    assert count["mesh: E of each element, rotation"] == 20


def test_a_mesh_of_the_text_keeps_its_recordings() -> None:
    text = ROLLER.read_text(encoding="utf-8")
    made = meshed(text, 2)
    assert made[made.index("[[recordings]]") :] == text[text.index("[[recordings]]") :]
    assert isinstance(ROLLER, Path) and "exact_beam" not in made
