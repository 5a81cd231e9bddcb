"""`include` of a [model]: the merged model is the one that is written whole, and every fault names
the file in which it stands."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from cvxupdate.spec import check_problem, load_problem
from cvxupdate.spec.write import tables_of, to_toml

WHOLE = """
[model]
dofs = ["x", "y", "rz"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.4 }, { id = 3, x = 1.0 }]

[model.materials.steel]
E = 207e9
rho = 7850.0

[model.materials.alloy]
E = 70e9
rho = 2700.0

[model.sections.bar]
shape = "rectangle"
width = 0.02
height = 0.01

[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [2, 3], material = "alloy" }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [3], m = 0.7 }]

[[model.supports]]
nodes = [1]
dofs = ["x", "y", "rz"]

[[model.supports]]
nodes = [3]
dofs = ["y"]

[model.damping]
kind = "structural"
eta = 0.02
"""
SHARED = """
[model]
dofs = ["x"]
nodes = { file = "nodes.csv" }

[model.materials.steel]
E = 207e9
rho = 7850.0

[model.materials.alloy]
E = 1e9

[model.sections.bar]
shape = "rectangle"
width = 0.02
height = 0.01

[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [2, 3], material = "alloy" }]

[[model.supports]]
nodes = [1]
dofs = ["x", "y", "rz"]

[model.damping]
kind = "rayleigh"
alpha = 0.3
"""
VARIANT = """
[model]
include = "../shared/model.toml"
dofs = ["x", "y", "rz"]
nodes = [{ id = 3, x = 1.0 }]

[model.materials.alloy]
E = 70e9
rho = 2700.0

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [3], m = 0.7 }]

[[model.supports]]
nodes = [3]
dofs = ["y"]

[model.damping]
kind = "structural"
eta = 0.02
"""


@pytest.fixture
def variant(tmp_path: Path) -> Path:
    """A problem file whose model is in another folder."""
    for name in ("shared", "variant"):
        (tmp_path / name).mkdir()
    (tmp_path / "shared" / "nodes.csv").write_text("id,x\n1,0.0\n2,0.4\n")
    (tmp_path / "shared" / "model.toml").write_text(SHARED)
    path = tmp_path / "variant" / "problem.toml"
    path.write_text(VARIANT)
    return path


def spoilt(variant: Path, old: str, new: str, shared: bool = True) -> Path:
    """The variant with one text replaced, in the included file or in its own."""
    path = variant.parents[1] / "shared" / "model.toml" if shared else variant
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return variant


def test_the_merged_model_is_the_one_written_whole(variant: Path, tmp_path: Path) -> None:
    whole = tmp_path / "whole.toml"
    whole.write_text(WHOLE)
    assert load_problem(variant).model == load_problem(whole).model


def test_a_file_that_adds_nothing_is_the_included_one(variant: Path, tmp_path: Path) -> None:
    whole = tmp_path / "whole.toml"
    whole.write_text(WHOLE)
    middle = tmp_path / "middle.toml"
    middle.write_text('[model]\ninclude = "variant/problem.toml"\n')  # itself with an include
    assert load_problem(middle).model == load_problem(whole).model


def test_a_problem_written_out_includes_nothing_and_is_the_same(
    variant: Path, tmp_path: Path
) -> None:
    spec = load_problem(variant)
    text = to_toml(tables_of(spec))
    assert "include" not in tomllib.loads(text)["model"]
    written = tmp_path / "written.toml"
    written.write_text(text)
    assert tables_of(load_problem(written)) == tables_of(spec)


def test_paths_of_an_included_matrix_are_relative_to_its_file(tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared" / "k.mtx").write_text("%%MatrixMarket matrix array real general\n1 1\n2\n")
    (tmp_path / "shared" / "model.toml").write_text(
        '[model]\ndofs = ["x"]\n[[model.elements]]\ntype = "matrix"\n'
        'rows = [{ id = 1, labels = ["n1.x"], stiffness = "k.mtx", mass = "k.mtx" }]\n'
    )
    path = tmp_path / "problem.toml"
    path.write_text('[model]\ninclude = "shared/model.toml"\n')
    (row,) = load_problem(path).model.elements[0].rows
    assert row.stiffness == row.mass == str(tmp_path / "shared" / "k.mtx")


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("E = 207e9", "E = -1.0", "model.materials.steel.E", ("-1.0 is negative",)),
        (
            'material = "steel"',
            'material = "steal"',
            "model.elements[0].material",
            ("'steel'",),
        ),
        ("nodes = [2, 3]", "nodes = [2, 9]", "model.elements[0].rows[1].nodes", ("9",)),
        ("nodes = [1]\n", "nodes = [8]\n", "model.supports[0].nodes", ("8",)),
        ('"nodes.csv"', '"nodos.csv"', "model.nodes.file", ("nodos.csv",)),
        ("[model]\n", "[model]\nnods = 3\n", "model.nods", ("unknown key", "'nodes'")),
        ("[model]\n", 'title = "x"\n[model]\n', "title", ("holds [model] and nothing else",)),
        ("[model]\n", "[modell]\n[model]\n", "modell", ("holds [model] and nothing else",)),
        ("[model]\n", "[model\n", "", ("not valid TOML",)),
    ],
    ids=["value", "name", "node", "support", "table", "key", "title", "tabel", "toml"],
)
def test_a_fault_of_the_included_file_names_that_file(
    variant: Path, old: str, new: str, key: str, words: tuple[str, ...]
) -> None:
    faults = check_problem(spoilt(variant, old, new))
    fault = next(f for f in faults if f.key == key)
    assert Path(fault.file).name == "model.toml"
    for word in words:
        assert word in str(fault)


def test_what_is_replaced_is_not_looked_at(variant: Path) -> None:
    assert check_problem(spoilt(variant, "alpha = 0.3", "alpha = -0.3")) == ()


def test_a_fault_in_a_table_of_the_included_file_names_table_and_line(variant: Path) -> None:
    (variant.parents[1] / "shared" / "nodes.csv").write_text("id,x\n1,0.0\n2,nan\n")
    (fault,) = check_problem(variant)
    assert Path(fault.file).name == "nodes.csv" and fault.key == "line 3, column x"


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("m = 0.7", "m = -0.7", "model.elements[0].rows[0].m"),
        ("nodes = [3]\ndofs", "nodes = [7]\ndofs", "model.supports[0].nodes"),
        ("id = 3, x = 1.0", 'id = 3, x = "1"', "model.nodes[0].x"),
        ("eta = 0.02", "eta = true", "model.damping.eta"),
        ("E = 70e9", "E = 0.0", "model.materials.alloy.E"),
    ],
    ids=["row", "support", "node", "damping", "material"],
)
def test_a_fault_beside_include_has_its_place_in_the_own_file(
    variant: Path, old: str, new: str, key: str
) -> None:
    faults = check_problem(spoilt(variant, old, new, shared=False))
    assert key in [f.key for f in faults if Path(f.file).name == "problem.toml"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("../shared/modell.toml", ("model.include", "there is no file", "Correct the name")),
        ("../shared", ("model.include", "is a folder")),
        ("problem.toml", ("model.include", "goes in a circle", "problem.toml → problem.toml")),
        ("", ("model.include", "is a folder", "Name a file in it")),
    ],
    ids=["missing", "folder", "itself", "empty"],
)
def test_an_include_that_leads_nowhere(variant: Path, name: str, words: tuple[str, ...]) -> None:
    (fault,) = check_problem(spoilt(variant, "../shared/model.toml", name, shared=False))
    assert Path(fault.file).name == "problem.toml"
    for word in words:
        assert word in str(fault)


def test_include_takes_one_name_in_quotes(variant: Path) -> None:
    faults = check_problem(spoilt(variant, '"../shared/model.toml"', "3", shared=False))
    assert "3 is not text" in str(next(f for f in faults if f.key == "model.include"))


def test_a_circle_of_two_files_is_told_in_the_file_that_closes_it(variant: Path) -> None:
    path = spoilt(variant, "[model]\n", '[model]\ninclude = "../variant/problem.toml"\n')
    (fault,) = check_problem(path)
    assert "problem.toml → model.toml → problem.toml" in fault.problem
    assert Path(fault.file).name == "model.toml" and fault.key == "model.include"


def test_files_may_lie_four_deep_and_no_deeper(tmp_path: Path) -> None:
    (tmp_path / "0.toml").write_text(WHOLE)
    for i in range(1, 7):
        (tmp_path / f"{i}.toml").write_text(f'[model]\ninclude = "{i - 1}.toml"\n')
    assert load_problem(tmp_path / "4.toml").model == load_problem(tmp_path / "0.toml").model
    (fault,) = check_problem(tmp_path / "5.toml")
    assert "more than 4 files" in fault.problem and Path(fault.file).name == "1.toml"
