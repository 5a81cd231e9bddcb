"""A problem written as TOML is the problem that was read."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.spec import load_problem
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
    assert [r.model_dump(exclude={"file"}) for r in again.recordings] == [
        r.model_dump(exclude={"file"}) for r in spec.recordings
    ]
