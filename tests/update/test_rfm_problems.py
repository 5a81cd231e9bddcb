"""The problem files of chapters 3 and 5 through `run`: iterations, p-values, noise, and what the
report says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cvxupdate
from tests.cases.problems import written_whole
from validation import make_rfm

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
bay = make_rfm.bay
BAY = np.zeros(40)
BAY[[i - 1 for i in bay.STIFF]] = 1 / 1.08 - 1
CHAIN = np.zeros(21)
CHAIN[[2, 4, 8]] = 0.10, 0.30, 0.10
CHAIN[[11, 14, 17]] = -0.10, -0.25, 0.15
FE2 = np.zeros(40)
FE2[[i - 1 for i in bay.THICK]] = 1 / 1.3 - 1
PLATE = np.zeros(135)
for k, of in enumerate(("stiffness", "mass", "damping")):
    PLATE[[45 * k + i - 1 for i in make_rfm.PLATE_HIGH[of]]] = 1 / 1.1 - 1


def run(name):
    updated = cvxupdate.run(PROBLEMS / name / "problem.toml")
    return updated, np.array([q.p for q in updated.parameters])


@pytest.mark.parametrize(
    ("name", "truth", "iterations", "tolerance"),
    [
        ("bay/fe1_x1_complete", BAY, 3, 1e-6),
        ("bay/fe1_x1_incomplete", BAY, 6, 1e-6),
        ("chain10/complete", CHAIN, 3, 1e-6),
        ("chain10/incomplete", CHAIN, 11, 1e-6),
        ("bay/fe2_x1", FE2, 12, 1e-6),
        ("plate_complex/0pct", PLATE, 8, 1e-4),
    ],
)
def test_without_noise_the_answer_is_exact(name, truth, iterations, tolerance):
    updated, p = run(name)
    assert updated.status == "converged" and updated.method == "rfm"
    assert updated.iterations <= iterations
    assert p == pytest.approx(truth, abs=tolerance)
    assert (
        updated.fit["fit"]["frf_error"]["after"]
        < 1e-6
        < 0.1
        < updated.fit["fit"]["frf_error"]["before"]
    )
    assert updated.certificate["optimal"]


def test_bay_with_noise_ranks_the_ten_elements():
    updated, p = run("bay/fe1_x1_noisy")
    wrong = np.flatnonzero(BAY)
    sound = np.setdiff1d(np.arange(20), wrong)
    assert updated.status == "converged"
    assert np.abs(p[wrong]).min() > 3 * np.abs(p[sound]).max()
    assert updated.noise == pytest.approx(1.0, abs=0.15)  # the stated deviation is the true one
    std = np.array([q.p_std for q in updated.parameters])
    assert np.sqrt(np.mean(((p - BAY) / std) ** 2)) == pytest.approx(
        1.0, abs=0.4
    )  # and the deviations of p are honest


def test_noisy_chain_finds_the_six_changes():
    updated, p = run("chain10/noisy")
    true = np.flatnonzero(CHAIN)
    assert updated.status == "converged"
    assert np.abs(p - CHAIN)[true].max() < 0.06
    assert np.abs(p[np.setdiff1d(np.arange(21), true)]).max() < 0.05 < np.abs(p[true]).min()


def test_mesh_error_stays_inside_bounds_and_is_called_what_it_is():
    """3.4.4 diverged to p = −1."""
    updated, p = run("bay/fe1_x2")
    assert updated.status == "converged"
    assert np.all(np.abs(p) < 0.2) and not any(q.at_bound for q in updated.parameters)
    error = updated.fit["fit"]["frf_error"]
    assert error["after"] < 0.5 * error["before"]
    assert any("not of the parameters' kind" in note for note in updated.notes)


def test_accuracy_problem():
    updated, p = run("bay/accuracy")
    assert updated.status == "converged" and np.abs(p - BAY).max() < 0.015
    assert any("bear" in note for note in updated.notes)


@pytest.mark.slow
def test_noisy_plate_finds_every_element_of_the_three_kinds(tmp_path):
    """On every second line: with half of what was recorded."""
    folder = PROBLEMS / "plate_complex/2pct"
    lines = np.load(folder / "frf.npz")["frequency"][::2].tolist()
    text, every = written_whole(folder / "problem.toml"), 'frequency_points = "all"'
    assert every in text
    (tmp_path / "problem.toml").write_text(text.replace(every, f"frequency_points = {lines}"))
    updated = cvxupdate.run(tmp_path / "problem.toml")
    p, true = np.array([q.p for q in updated.parameters]), PLATE != 0
    assert updated.status == "converged"
    assert np.abs(p[~true]).max() < 0.0909 / 3
    assert np.abs(p[true]).min() > np.abs(p[~true]).max()


def test_solvers_agree_on_the_first_step():
    _, rows, spread = cvxupdate.solvers(PROBLEMS / "bay/fe1_x1_complete" / "problem.toml")
    good = [r for r in rows if r.status == "optimal"]
    assert len(good) >= 3 and spread < 1e-5


@pytest.mark.parametrize(("name", "truth"), [("bay/fe1_x1_incomplete", BAY), ("bay/fe2_x1", FE2)])
@pytest.mark.parametrize(
    "keys",
    ["second_order = true", "second_order = true\nline_search = true", 'form = "multiplicative"'],
)
def test_forms_of_the_iteration(name, truth, keys, tmp_path):
    """Second-order terms save iterations on incomplete coordinates; every form ends at the
    truth."""
    plain, _ = run(name)
    text = written_whole(PROBLEMS / name / "problem.toml")
    text = text.replace('method = "rfm"', f'method = "rfm"\n{keys}')
    (tmp_path / "problem.toml").write_text(text)
    updated = cvxupdate.run(tmp_path / "problem.toml")
    assert updated.status == "converged"
    assert np.array([q.p for q in updated.parameters]) == pytest.approx(truth, abs=1e-6)
    assert (
        updated.iterations < plain.iterations
        if "second_order" in keys
        else updated.iterations <= plain.iterations
    )
