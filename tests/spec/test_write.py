"""A problem written as TOML is the problem that was read."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import check_problem, load_problem
from cvxupdate.spec.write import compacted, tables_of, to_toml


@pytest.mark.parametrize(
    "where",
    [
        "tests/spec/good/problem.toml",
        "problems/structure_a/problem.toml",
        "problems/concealed/o04/problem.toml",
    ],
)
def test_a_problem_written_is_the_problem_read(tmp_path: Path, where: str) -> None:
    """Every table, tables in CSV files included, from another folder."""
    spec = load_problem(Path(__file__).parents[2] / where)
    path = tmp_path / "problem.toml"
    path.write_text(to_toml(compacted(tables_of(spec)), ["one", "two\nthree"]), encoding="utf-8")
    again = load_problem(path)
    assert tomllib.loads(path.read_text(encoding="utf-8"))["model"]["dofs"] == list(spec.model.dofs)
    for name in (
        "title",
        "source",
        "update",
        "constraints",
        "regularisation",
        "solver",
        "diagnose",
    ):
        assert getattr(again, name) == getattr(spec, name), name
    one, other = build_model(spec), build_model(again)
    assert one.labels == other.labels
    for which in "KMCD":
        a, b = getattr(one.matrices(), which), getattr(other.matrices(), which)
        assert abs(a - b).max() == 0.0
    assert [r.model_dump(exclude={"file", "source"}) for r in again.recordings] == [
        r.model_dump(exclude={"file", "source"}) for r in spec.recordings
    ]


MODES = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }]
elements = [{ type = "spring", dof = "x", rows = [{ id = 1, nodes = [1], k = 4e5 }] },
            { type = "mass", rows = [{ id = 2, nodes = [1], m = 5.0 }] }]
[[recordings]]
kind = "modes"
file = "modes.csv"
"""


def test_a_table_of_modes_is_written_with_its_rows_and_without_its_file(tmp_path: Path) -> None:
    """Of two tables one would be read and the other one be looked at; the name stays."""
    (tmp_path / "modes.csv").write_text("frequency_Hz,damping_pct,1:+X\n45.0,1.0,1\n")
    (tmp_path / "p.toml").write_text(MODES, encoding="utf-8")
    spec = load_problem(tmp_path / "p.toml")
    (recording,) = tables_of(spec)["recordings"]
    assert "file" not in recording and recording["rows"][0]["frequency"] == 45.0
    assert recording["name"] == recording["source"] == "modes.csv"
    (tmp_path / "sub").mkdir()
    again = tmp_path / "sub" / "again.toml"
    again.write_text(to_toml(compacted(tables_of(spec))), encoding="utf-8")
    (one,), (other,) = (load_recordings(load_problem(p)) for p in (tmp_path / "p.toml", again))
    assert isinstance(one, ModeTable) and isinstance(other, ModeTable)
    assert one.origin.name == other.origin.name and one.channels == other.channels
    np.testing.assert_array_equal(one.frequency, other.frequency)
    np.testing.assert_array_equal(one.damping, other.damping)
    np.testing.assert_array_equal(np.asarray(one.shapes), np.asarray(other.shapes))


def test_rows_that_contradict_their_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text("frequency_Hz,damping_pct,1:+X\n45.0,1.0,1\n")
    path = tmp_path / "p.toml"
    start = "differ from 'modes.csv', which `file` names beside them: "
    channel = 'channels = [{ column = 0, quantity = "displacement", node = 1, dof = "x" }]\n'
    for rows, says in (
        ("{ frequency = 45.0, damping = 0.01, shape = [1.0], mode = 1 }", ""),
        (
            "{ frequency = 45.5, damping = 0.01, shape = [1.0] }",
            "frequency of row 1 is 45.5 here, ",
        ),
        ("{ frequency = 45.0, damping = 0.01 }", "shape of row 1 is None here, [1] there."),
        ("{ frequency = 45.0 }, { frequency = 90.0 }", "2 here, 1 there."),
    ):
        path.write_text(f"{MODES}{channel}rows = [{rows}]\n", encoding="utf-8")
        said = [f for f in check_problem(path) if f.key == "recordings[0].rows"]
        assert [f.problem.startswith(start + says) for f in said] == [True] * bool(says), rows
    (tmp_path / "modes.csv").unlink()
    assert not check_problem(path)  # nothing to differ from
