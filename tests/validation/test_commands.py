"""Every command on structures and recordings that lack something: one node, no force, no motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validation import commands
from validation.commands import COMMANDS, Ended, one, problem_files

SPRING = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 4.0e4, group = "spring" }]
[[model.elements]]
type = "dashpot"
dof = "x"
rows = [{ id = 2, nodes = [1], c = 12.0, group = "damper" }]
[[model.elements]]
type = "mass"
rows = [{ id = 3, nodes = [1], m = 2.0, group = "mass" }]
"""
UPDATE = """
[update]
method = "{method}"
parameters = [{{ group = "spring", of = "k" }}]
"""
TIME = """
[[recordings]]
kind = "time"
file = "record.csv"
rate = 400.0
delimiter = ","
channels = [{channels}]
"""
FORCE = '{ column = 0, quantity = "force", node = 1, dof = "x" }'
MOVED = '{ column = 1, quantity = "displacement", node = 1, dof = "x" }'
VOLTS = '{ column = 1, quantity = "voltage", unit = "V" }'
SPECTRUM = """
[[recordings]]
kind = "frf"
file = "spectrum.csv"
delimiter = ","
response = "acceleration"
frequency_column = 0
references = []
channels = [{ column = 1, quantity = "acceleration", node = 1, dof = "x" }]
"""
MODES = '\n[[recordings]]\nkind = "modes"\nrows = [{ frequency = 23.1, frequency_std = 0.02 }]\n'


def history(*channels: str) -> str:
    """A recording in time with some of the channels."""
    return TIME.replace("{channels}", ", ".join(channels))


PROBLEMS = {
    "one node, a table": SPRING + MODES,
    "one node, force and motion": SPRING + history(FORCE, MOVED),
    "no force": SPRING + history(MOVED),
    "no motion": SPRING + history(FORCE),
    "volts": SPRING + history(VOLTS),
    "a spectrum": SPRING + SPECTRUM,
    "no stiffness": SPRING.replace("k = 4.0e4", "k = 0.0") + history(FORCE, MOVED),
    "levels": SPRING
    + history(FORCE, MOVED).replace('"time"', '"time"\nlevel = 1.0')
    + history(FORCE, MOVED).replace('"time"', '"time"\nlevel = 2.0'),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of one mass on a spring, driven by noise."""
    here = tmp_path_factory.mktemp("records")
    rng = np.random.default_rng(3)
    force, x, v, dt = rng.standard_normal(1600), 0.0, 0.0, 1 / 400.0
    moved = []
    for f in force:
        for _ in range(8):
            v += dt / 8 * (f - 4.2e4 * x - 12.0 * v) / 2.0
            x += dt / 8 * v
        moved.append(x)
    np.savetxt(here / "record.csv", np.column_stack([force, moved]), delimiter=",")
    f = np.linspace(5.0, 60.0, 120)
    size = np.abs(1.0 / (4.2e4 - 2.0 * (2 * np.pi * f) ** 2 + 24j * np.pi * f))
    np.savetxt(here / "spectrum.csv", np.column_stack([f, size]), delimiter=",")
    return here


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_no_command_fails(name, command, folder, capsys):
    text = PROBLEMS[name]
    if command in ("run", "solvers"):
        text += UPDATE.format(method="frequencies" if name == "one node, a table" else "rfm")
    file = folder / f"{name}.toml".replace(" ", "_")
    file.write_text(text, encoding="utf-8")
    status = one(command, str(file), str(folder / "out"), short=2.0)
    said = capsys.readouterr()
    assert status in (0, 2, 3), said.err
    assert status == 0 or said.err.startswith("cvxupdate: ") or "status" in said.out
    assert "Traceback" not in said.err


def test_files_with_recordings_are_tried_and_a_failure_is_one(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[[recordings]]\n", encoding="utf-8")
    (tmp_path / "b.toml").write_text("[model]\n", encoding="utf-8")
    assert list(problem_files([tmp_path])) == [tmp_path / "a.toml"]
    states = {s: Ended(tmp_path, "run", s, "", 1.0).failed for s in (0, 1, 2, 3, commands.STOPPED)}
    assert [s for s, failed in states.items() if failed] == [1]
    assert "FAILED" in Ended(tmp_path, "run", 1, "why", 1.0).line
