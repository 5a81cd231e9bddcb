"""Whatever is done to a good problem file, it loads or gives a `ProblemFileError`: no other
exception, never a message without remedy."""

from __future__ import annotations

import copy
import datetime
import json
import math
import tomllib
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cvxupdate.errors import ProblemFileError
from cvxupdate.spec import check_problem, load_problem

GOOD = Path(__file__).parent / "good"
PLAIN = tomllib.loads((GOOD / "problem.toml").read_text())

MATRIX = tomllib.loads("""
[model]
dofs = ["x"]
[[model.elements]]
type = "matrix"
file = "run.csv"
labels = ["n1.x", "n2.x"]
rows = [{ id = 1, group = "a", stiffness = "K" }, { id = 2, mass = "run.npz" },
        { id = 3, structural = "D", file = "run.csv", labels = "auto" }]
[[recordings]]
kind = "frf"
file = "run.csv"
references = [{ node = 1, dof = "x" }]
channels = [{ column = 0, quantity = "displacement", node = 2, dof = "x", index = [1, 2] }]
[update]
method = "rfm"
parameters = [{ elements = "all", of = "stiffness", each = "group" }, { of = "alpha", scale = 1.0 }]
[[regularisation]]
kind = "group-l1"
groups = [["a.stiffness"]]
""")

names = st.sampled_from(
    [
        "x",
        "id",
        "nodes",
        "rows",
        "file",
        "dataset",
        "type",
        "kind",
        "shape",
        "labels",
        "E",
        "k",
        "dofs",
        "elements",
        "groups",
        "each",
        "all",
        "",
        "beam3d",
        "plate",
        "matrix",
        "spring",
        "../x",
        "a\0b",
        "run.csv",
        "auto",
        "n1.x",
        "ry",
        "é" * 300,
        "name",
        "scale",
        "damping",
        "alpha",
    ]
)
scalars = st.one_of(
    st.integers(-3, 60),
    st.integers(-(10**400), 10**400),
    st.floats(allow_nan=True),
    st.booleans(),
    names,
    st.just(datetime.date(2026, 6, 8)),
)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=4),
    max_leaves=8,
)


def places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    out = [at] if at else []
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    return out + [p for key, item in items for p in places(item, (*at, key))]


def write(value: Any) -> str:
    """TOML by hand, every table inline (there is no writer in the standard library)."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return (
            str(value)
            if not math.isfinite(value)
            else repr(value)
            if "." in repr(value)
            else f"{value:.17e}"
        )
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=True)
    if isinstance(value, list):
        return "[" + ", ".join(write(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {write(v)}" for k, v in value.items()) + "}"
    return str(value)


def spoilt(good: dict[str, Any], changes: list[tuple[int, str, Any, str]]) -> dict[str, Any]:
    data = copy.deepcopy(good)
    all_places = places(good)
    for index, action, value, key in changes:
        *path, last = all_places[index % len(all_places)]
        try:
            here: Any = data
            for step in path:
                here = here[step]
            if action == "set":
                here[last] = value
            elif action == "delete":
                del here[last]
            elif action == "double" and isinstance(here, list):
                here.append(copy.deepcopy(here[last]))
            elif isinstance(here, dict):
                here[key] = value
        except (KeyError, IndexError, TypeError):  # an earlier change took the place away
            continue
    return data


change = st.tuples(
    st.integers(0, 10_000), st.sampled_from(["set", "delete", "double", "add"]), values, names
)


def assert_faults_are_complete(path: Path) -> None:
    try:
        spec = load_problem(path)
    except ProblemFileError as error:
        assert error.faults and all(f.file and f.problem and f.remedy for f in error.faults), (
            error.faults
        )
        assert check_problem(path) == error.faults
    else:
        assert spec.model.elements and check_problem(path) == ()


@settings(
    max_examples=150,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    derandomize=True,
)
@given(
    changes=st.lists(change, min_size=1, max_size=3), start=st.sampled_from([PLAIN, PLAIN, MATRIX])
)
def test_changed_values(
    good: Path, changes: list[tuple[int, str, Any, str]], start: dict[str, Any]
) -> None:
    good.write_text(
        "\n".join(f"{json.dumps(k)} = {write(v)}" for k, v in spoilt(start, changes).items())
    )
    assert_faults_are_complete(good)


@settings(
    max_examples=80,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)
@given(at=st.integers(0, 3000), cut=st.integers(0, 40), put=st.binary(max_size=12))
def test_changed_bytes(good: Path, at: int, cut: int, put: bytes) -> None:
    blob = (GOOD / "problem.toml").read_bytes()
    good.write_bytes(blob[:at] + put + blob[at + cut :])
    assert_faults_are_complete(good)


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)
@given(
    text=st.binary(max_size=60) | st.text("id,nodes\n;12 .xe-\"'#\t", max_size=60).map(str.encode),
    table=st.sampled_from(["nodes", "rows"]),
)
def test_any_csv_file(good: Path, text: bytes, table: str) -> None:
    (good.parent / "t.csv").write_bytes(text)
    data = copy.deepcopy(PLAIN)
    (data["model"] if table == "nodes" else data["model"]["elements"][0])[table] = {"file": "t.csv"}
    good.write_text("\n".join(f"{json.dumps(k)} = {write(v)}" for k, v in data.items()))
    assert_faults_are_complete(good)


def test_the_writer_of_this_test_keeps_the_good_file(good: Path) -> None:
    good.write_text("\n".join(f"{json.dumps(k)} = {write(v)}" for k, v in PLAIN.items()))
    assert tomllib.loads(good.read_text()) == PLAIN and check_problem(good) == ()
