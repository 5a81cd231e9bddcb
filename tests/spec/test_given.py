"""A problem in any form is one problem; what is none is said in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.spec import spec_of
from cvxupdate.spec.given import again, plain
from cvxupdate.spec.write import tables_of, to_toml

TABLES = {
    "title": "two storeys",
    "model": {
        "dofs": ("x",),
        "nodes": [{"id": np.int64(1), "x": np.float32(0.0)}, {"id": 2, "x": 3.0, "y": None}],
        "elements": [
            {
                "type": "spring",
                "dof": "x",
                "rows": [{"id": 1, "nodes": np.array([1, 2]), "k": 4e5}],
            },
            {"type": "mass", "rows": [{"id": 2, "nodes": [1], "m": 6.5}]},
        ],
    },
}


def test_a_path_a_text_and_tables_are_one_problem(tmp_path: Path) -> None:
    spec = spec_of(TABLES)
    text = to_toml(tables_of(spec))
    (tmp_path / "two.toml").write_text(text)
    assert spec_of(spec) is spec and spec.name == "model"
    for other in (text, tmp_path / "two.toml", str(tmp_path / "two.toml")):
        assert tables_of(spec_of(other)) == tables_of(spec)
    assert again(spec_of(tmp_path / "two.toml")) == str(tmp_path / "two.toml")
    assert tables_of(spec_of(again(spec))) == tables_of(spec)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (17, "is no problem"),
        (None, "is no problem"),
        ({}, "model"),
        ({"model": {}, "x": 1}, "unknown key 'x'"),
        ({"model": lambda: 1}, "a function has no place"),
        ({3.5: 1}, "is no text"),
        ("title = ", "not valid TOML"),
        ("a = " + "[" * 3000, "not valid TOML|nested too deeply"),
        ("no/such/file.toml", "no such file"),
        ({"title": np.datetime64("2020-01-01")}, "has no place"),
    ],
)
def test_what_is_none_is_said(given, says: str) -> None:
    with pytest.raises(InputError, match=says):
        spec_of(given)


def test_a_dictionary_that_holds_itself() -> None:
    tables: dict = {"model": {}}
    tables["model"]["again"] = tables
    with pytest.raises(InputError, match="Does it hold itself"):
        spec_of(tables)


def test_plain_turns_arrays_into_lists() -> None:
    assert plain({"a": np.eye(2), "b": (1, 2 + 1j), "c": Path("x")}) == {
        "a": [[1.0, 0.0], [0.0, 1.0]],
        "b": [1, [2.0, 1.0]],
        "c": "x",
    }
