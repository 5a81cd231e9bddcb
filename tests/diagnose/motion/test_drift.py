"""A structure that changes while it is measured: told apart from one that depends on the level."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.motion.drift import (
    Drift,
    _in_common,
    _of_levels,
    clock_not_level,
    is_sweep,
)
from cvxupdate.diagnose.settings import CLOCK_GAIN, CLOCK_PART
from cvxupdate.study import diagnose
from tests.cases.shaken import MODEL, RATE, shaken

STEPS = {"a": 0.01, "b": -0.03}


def test_runs_of_one_level_have_their_step_in_common():
    assert _of_levels([1.0, 4.0, 1.01, 4.0]).tolist() == [[1, 0], [0, 1], [1, 0], [0, 1]]


def test_a_sweep_has_other_frequencies_in_the_end_than_in_the_beginning():
    t = np.arange(4000) / 200.0
    chirp = np.sin(2.0 * np.pi * (1.0 + 0.5 * 40.0 * t / t[-1]) * t)[:, None]
    noise = np.random.default_rng(3).standard_normal((4000, 2))
    assert is_sweep(chirp) and is_sweep(chirp[::-1])
    assert not is_sweep(noise) and not is_sweep(np.sin(2.0 * np.pi * 7.0 * t)[:, None])
    assert not is_sweep(np.zeros((4000, 1)))


def test_sweeps_of_one_level_have_their_ramp_in_common_too():
    """With the frequency the amplitude goes, and with that what a law does: at each level
    otherwise."""
    t = np.arange(4000) / 200.0
    chirp = np.sin(2.0 * np.pi * (1.0 + 20.0 * t / t[-1]) * t)[:, None]
    noise = np.random.default_rng(3).standard_normal((4000, 1))
    runs = [
        SimpleNamespace(level=v, force=f) for v, f in ((1.0, chirp), (1.0, noise), (4.0, chirp))
    ]
    assert _in_common(runs).tolist() == [
        [1, 0, 0, 0],
        [1, 0, 0, 0],
        [0, 1, 0, 0],
        [0, 0, 1, 0],
        [0, 0, 0, 0],
        [0, 0, 0, 1],
    ]
    assert _in_common(runs[1:2]).tolist() == [[1], [0]]


@pytest.mark.parametrize(
    ("drift", "law", "left", "clock"),
    [
        (Drift(0.9, None, STEPS, {}, 900.0, 300.0, 50.0), 400.0, 500.0, True),
        (Drift(0.9, None, STEPS, {}, 900.0, 300.0, 50.0), 5000.0, 400.0, True),
        (Drift(0.9, None, STEPS, {}, 900.0, 300.0, 50.0), 5000.0, 60.0, False),
        (Drift(0.5 * CLOCK_PART, None, STEPS, {}, 900.0, 300.0, 50.0), 0.0, 500.0, False),
        (Drift(0.9, None, STEPS, {}, 900.0, 0.9 * CLOCK_GAIN, 50.0), 0.0, 500.0, False),
    ],
    ids=["takes more", "leaves less", "the law leaves as little", "a small part", "chance"],
)
def test_drift_must_be_the_better_explanation(drift, law, left, clock):
    assert clock_not_level(drift, law, left) == clock


def test_steps_are_said_against_the_first_run():
    text = Drift(0.7, "roof", STEPS, {"a": 0.002, "b": 0.0}).says
    assert "of group 'roof' follows the clock" in text
    assert "+0 % in a, -4 % in b, against the first" in text and "4 % between runs" in text


def problem(folder, changes, levels, law=None):
    text = MODEL
    for k, ((start, end), level) in enumerate(zip(changes, levels, strict=True)):
        run = shaken(law, level=level, seed=20 + k, start=start, end=end)
        np.savez(folder / f"run{k}.npz", data=run.data)
        text += f"""
[[recordings]]
kind = "time"
use = "{"hold-out" if k == len(levels) - 1 else "fit"}"
level = {level}
file = "run{k}.npz"
response = "acceleration"
rate = {RATE}
channels = [
  {{ column = 0, quantity = "force", node = 2, dof = "x" }},
  {{ column = 1, quantity = "acceleration", node = 1, dof = "x" }},
  {{ column = 2, quantity = "acceleration", node = 2, dof = "x" }},
]
"""
    (folder / "problem.toml").write_text(text, encoding="utf-8")
    return folder / "problem.toml"


def test_a_structure_that_loosens_is_said_to_and_nothing_else_is_claimed(tmp_path):
    changes = [(0.0, 0.0), (-0.06, -0.06), (-0.12, -0.12), (-0.15, -0.15)]
    said: list[str] = []
    found = diagnose(problem(tmp_path, changes, [1.0, 1.0, 1.0, 1.0]), said.append)
    assert found.verdict == "undetermined" and not found.findings
    assert not any("screening" in line for line in said)  # what cannot be claimed is not sought
    assert "changed while it was measured" in found.says
    assert "of group 'upper' follows the clock" in found.says
    assert any("at one level, resonances move down" in line for line in found.evidence)


def test_one_that_does_not_is_consistent(tmp_path):
    found = diagnose(problem(tmp_path, [(0.0, 0.0)] * 3, [1.0, 3.0, 2.0]))
    assert found.verdict == "consistent" and not found.findings
    assert not any("clock" in line or "resonances move" in line for line in found.evidence)
