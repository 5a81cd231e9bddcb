"""What a walk with bad inputs broke: every command answers with one message and exit 2, at once,
and writes nothing."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cvxupdate import cli

PROBLEM = """title = "t"
[model]
dofs = ["y", "rz"]
nodes = { file = "nodes.csv" }
materials = { steel = { E = 210e9, rho = 7850.0 } }
sections = { bar = { shape = "rectangle", width = 0.04, height = 0.008 } }
supports = [{ nodes = [1], dofs = ["y", "rz"] }]
[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [2, 3] }]
[[recordings]]
kind = "modes"
rows = [{ frequency = 14.0, frequency_std = 0.1 }, { frequency = 88.0, frequency_std = 0.5 }]
[update]
method = "frequencies"
parameters = [{ elements = [1], of = "stiffness" }]
"""
NODES = "id,x,y\n1,0,0\n2,0.4,0\n3,0.7,0\n"
PROBLEMS = ["check", "view", "correlate", "run", "diagnose", "identify", "plan", "solvers"]
Call = Callable[..., tuple[int, str]]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nodes.csv").write_text(NODES)
    (tmp_path / "good.toml").write_text(PROBLEM)

    def go(*arguments: object) -> tuple[int, str]:
        before = sorted(tmp_path.rglob("*"))
        monkeypatch.setattr(sys, "argv", ["cvxupdate", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        said = capsys.readouterr()
        assert sorted(tmp_path.rglob("*")) == before, "something was written"
        assert "error of cvxupdate itself" not in said.err
        return int(stop.value.code or 0), " ".join((said.out + said.err).split())

    return go


def spoilt(old: str, new: str) -> str:
    assert old in PROBLEM
    Path("bad.toml").write_text(PROBLEM.replace(old, new, 1))
    return "bad.toml"


@pytest.mark.parametrize("command", PROBLEMS)
def test_a_pipe_or_a_device_is_no_problem_file(command: str, call: Call) -> None:
    """They were read for ever."""
    os.mkfifo("pipe.toml")
    for name in ("pipe.toml", "/dev/zero"):
        code, said = call(command, name)
        assert code == 2 and "is not a file" in said


@pytest.mark.parametrize("command", PROBLEMS)
@pytest.mark.parametrize(
    ("old", "new", "key"),
    [("210e9", "1e308", "materials.steel.E"), ("7850.0", "1e77", "materials.steel.rho")],
)
def test_a_number_beyond_all_quantities(
    command: str, old: str, new: str, key: str, call: Call
) -> None:
    """Overflows in numpy's words, then "in order", "stopped", or a traceback."""
    code, said = call(command, spoilt(old, new))
    assert code == 2 and key in said and "is larger than any quantity in SI" in said
    assert "Warning" not in said


def test_a_node_beyond_all_places(call: Call) -> None:
    Path("nodes.csv").write_text(NODES.replace("0.7", "1e200"))
    code, said = call("check", "good.toml")
    assert code == 2 and "nodes.csv: line 4, column x: 1e+200 is larger" in said


@pytest.mark.parametrize("command", ["check", "run", "diagnose"])
def test_a_model_without_mass(command: str, call: Call) -> None:
    """`check` said "in order", `diagnose` an IndexError."""
    code, said = call(command, spoilt("7850.0", "0.0"))
    assert code == 2 and "it carries no mass. Add density or lumped masses." in said


def test_a_short_row_of_a_table(call: Call) -> None:
    """What it lacked was taken for zero."""
    Path("nodes.csv").write_text(NODES.replace("2,0.4,0", "2,0.4"))
    code, said = call("check", "good.toml")
    assert code == 2 and "line 3: 2 cells under 3 column names" in said


@pytest.mark.parametrize("command", ["view", "correlate", "run", "diagnose", "solvers"])
def test_a_place_that_takes_no_results_is_said_before_the_work(command: str, call: Call) -> None:
    """Permissions show neither of these."""
    for out, why in (("y" * 300, "name too long"), ("/proc/results", "No such file")):
        code, said = call(command, "good.toml", "--out", out)
        assert code == 2 and "the results cannot be written there" in said and why in said


@pytest.mark.parametrize("command", ["inspect", "identify"])
def test_what_is_no_file_of_recordings(command: str, call: Call) -> None:
    os.mkfifo("pipe.csv")
    os.mkdir("folder")
    for name, words in (
        ("folder", "is a folder. Name a file in it."),
        ("pipe.csv", "is not a file that can be read through"),
        ("/dev/zero", "is not a file that can be read through"),
        ("q" * 300 + ".csv", "there is no such file"),
    ):
        code, said = call(command, name)
        assert code == 2 and words in said, name


def test_a_device_is_no_diagnosis(call: Call) -> None:
    code, said = call("plan", "good.toml", "--diagnosis", "/dev/zero")
    assert code == 2 and "/dev/zero is not a file. Give the diagnosis.json of diagnose." in said


def test_a_small_model_has_no_room_for_six_modes(call: Call) -> None:
    """The message named an option that nobody had given."""
    code, said = call("plan", "good.toml")
    assert code == 2 and "or ask for fewer --modes" in said
    assert call("plan", "nowhere.toml")[0] == 2
