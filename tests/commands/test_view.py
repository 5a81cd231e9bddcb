"""`view`: the problem as it stands, also where it is wrong."""

import json
import sys

import numpy as np
import pytest

from cvxupdate import cli
from cvxupdate.commands.new import new
from cvxupdate.commands.view import view
from cvxupdate.errors import InputError
from cvxupdate.report.view_page import view_page
from tests.commands.test_plan import BEAM


@pytest.fixture
def frame(tmp_path):
    new("frame", tmp_path / "frame")
    return tmp_path / "frame/problem.toml"


def test_the_command_writes_page_and_json(frame, monkeypatch, capsys):
    monkeypatch.chdir(frame.parent)
    monkeypatch.setattr(sys, "argv", ["cvxupdate", "view", "problem.toml", "--modes", "4"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 0 and "25 nodes, 24 elements" in capsys.readouterr().out
    folder = next((frame.parent / "out").rglob("view"))
    data = json.loads((folder / "result.json").read_text())
    assert len(data["frequencies"]) == 4 and data["faults"] == [] and data["rigid"] == 0
    assert data["sensors"][0] == "n4.x" and data["extent"] == pytest.approx([1.6, 1.2, 0.0])
    page = (folder / "report.html").read_text()
    assert page.count("<svg") == 5 and page.count("<animate") == 4 and "<script" not in page
    assert "left column, beam, right column" in page and "1, 25" in page


def test_frequencies_and_shapes_are_the_models(tmp_path):
    path = tmp_path / "beam.toml"
    path.write_text(BEAM, encoding="utf-8")
    found = view(path, 3)
    assert len(found.shapes) == 3 and found.shapes[0].shape == (7, 3)
    assert np.all(np.diff(found.frequencies) > 0.0)
    lowest = np.abs(found.shapes[0][:, 1])
    assert lowest[0] == 0.0 and np.all(np.diff(lowest) > 0.0)  # a cantilever's first
    assert found.mass == pytest.approx(0.4 + 4.0e-4 * 7800.0 * 1.15)
    assert "None" not in view_page(found).split("Supports")[1].split("Where")[0]


def test_what_is_wrong_is_said_and_the_rest_is_shown(tmp_path):
    path = tmp_path / "beam.toml"
    path.write_text(BEAM.replace('["y", "rz"] }]\nnodes', '["y"] }]\nnodes'), encoding="utf-8")
    loose = view(path)
    assert loose.rigid == 1 and "rigid body in 1 way:" in loose.notes[0]
    path.write_text(BEAM + '[[recordings]]\nkind = "frf"\nfile = "no.uff"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"there is no file"):
        view(path)
    (tmp_path / "no.uff").write_text("no universal file\n", encoding="utf-8")
    unread = view(path)
    assert "recordings are not shown" in unread.faults[0] and len(unread.frequencies) == 6
    assert "recordings are not shown" in view_page(unread)


def test_a_mechanism_is_drawn_without_modes(tmp_path):
    path = tmp_path / "beam.toml"
    loose = BEAM.replace("{ id = 7, x = 1.15 }", "{ id = 7, x = 1.15 }, { id = 8, x = 1.3 }")
    loose += '[[model.elements]]\ntype = "spring"\ndof = "y"\n'
    loose += "rows = [{ id = 12, nodes = [7, 8], k = 0.0 }]\n"
    loose = loose.replace("m = 0.4, group", "m = 0.4 }, { id = 13, nodes = [8], m = 0.1, group")
    path.write_text(loose, encoding="utf-8")
    found = view(path)
    assert "modes are not shown" in found.faults[0] and found.frequencies == ()
    assert "<svg" in view_page(found)


def test_modes_are_counted_from_one(frame):
    with pytest.raises(InputError, match="give 1 to 60"):
        view(frame, 0)
