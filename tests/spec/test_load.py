"""What a good problem file becomes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import ProblemFileError
from cvxupdate.spec import check_problem, expand_parameters, load_problem, schema

Spoil = Callable[..., Path]
CHALLENGE = Path(os.environ.get("CVXUPDATE_CHALLENGE", "/work/shared/challenge"))
BEAMS = """rows = [
  { id = 1, nodes = [1, 2], group = "root", orientation = [0.0, 0.0, 1.0] },
  { id = 2, nodes = [2, 3], group = "tip" },
]"""


def test_the_good_file(good: Path) -> None:
    spec = load_problem(good)
    assert spec.name == "good" and spec.title == "Cantilever with a panel" and spec.path == good
    assert check_problem(good) == ()
    beam, plate, spring, mass, dashpot = spec.model.elements
    assert (
        beam.type == "beam3d"
        and beam.rows[1].material == "steel"
        and beam.rows[0].orientation == (0.0, 0.0, 1.0)
    )
    assert plate.type == "plate" and plate.mass == "lumped" and plate.rows[0].section == "skin"
    assert spring.type == "spring" and [r.k for r in spring.rows] == [1.5e4, 2e3]
    assert [r.directions for r in spring.rows] == [("z",), ("ry",)]
    assert mass.type == "mass" and mass.rows[0].m == 0.35 and mass.rows[0].Iyy == 0.0
    assert dashpot.type == "dashpot" and dashpot.rows[0].directions == ("y", "z")
    modes, run = spec.recordings
    assert modes.kind == "modes" and modes.rows[1].shape == ((-0.7, 0.01), (1.0, 0.0))
    assert run.file == good.parent / "run.csv" and run.use == "hold-out"
    assert spec.solver.name == "CLARABEL" and spec.diagnose.physics == ("added_mass", "clearance")
    assert [r.kind for r in spec.regularisation] == ["tikhonov"]
    with pytest.raises(Exception, match="frozen"):
        spec.model.nodes[0].x = 1.0  # type: ignore[misc]


def test_defaults(spoil: Spoil, good: Path) -> None:
    text = good.read_text()
    good.write_text(text[: text.index("[update]")])
    spec = load_problem(good)
    assert spec.update is None and spec.diagnose.physics is None and spec.regularisation == ()
    assert spec.constraints.bounds is None and spec.solver.name == "CLARABEL"


def test_names_of_parameters(good: Path) -> None:
    spec = load_problem(good)
    assert spec.update is not None
    targets = expand_parameters(spec.model, spec.update.parameters)
    assert [t.name for t in targets] == [
        "e1.stiffness",
        "e2.stiffness",
        "e11.stiffness",
        "e21.stiffness",
        "e22.stiffness",
        "skin",
        "steel.rho",
    ]
    assert (
        targets[-1].elements == (1, 2, 11)
        and targets[5].group == "panel"
        and targets[0].lower == -0.4
    )


@pytest.mark.parametrize(
    ("row", "names"),
    [
        ('{ elements = [2, 1], of = "E" }', {"e2+e1.E": (2, 1)}),
        (
            '{ elements = "all", of = "E", each = "group" }',
            {"root.E": (1,), "tip.E": (2,), "panel.E": (11,)},
        ),
        ('{ groups = ["tip", "root"], of = "E" }', {"tip+root.E": (2, 1)}),
        (
            '{ groups = ["tip", "root"], of = "E", each = "group", name = "b" }',
            {"b.root": (1,), "b.tip": (2,)},
        ),
        ('{ elements = "all", of = "m" }', {"all.m": (31,)}),
        ('{ elements = "all", of = "c" }', {"all.c": (41,)}),
        ('{ of = "eta" }', {"damping.eta": ()}),
        ('{ of = "alpha", scale = 1.0 }', {"damping.alpha": ()}),
        (
            '{ elements = "all", of = "height", each = "element" }',
            {"e1.height": (1,), "e2.height": (2,)},
        ),
        (
            '{ elements = "all", of = "damping", each = "group" }',
            {
                "root.damping": (1,),
                "tip.damping": (2,),
                "panel.damping": (11,),
                "suspension.damping": (21,),
            },
        ),
    ],
)
def test_ways_to_choose(row: str, names: dict[str, tuple[int, ...]], good: Path) -> None:
    text = good.read_text()
    good.write_text(
        text[: text.index("[update]")] + f'[update]\nmethod = "sensitivity"\nparameters = [{row}]\n'
    )
    spec = load_problem(good)
    assert spec.update is not None
    assert {
        t.name: t.elements for t in expand_parameters(spec.model, spec.update.parameters)
    } == names


def test_tables_from_csv(spoil: Spoil, good: Path) -> None:
    here = good.parent
    (here / "beams.csv").write_text(
        "# beams\nid;nodes;group;orientation\n1;1 2;root;0 0 1\n\n2;2 3;7;\n"
    )
    (here / "modes.csv").write_text(
        "﻿frequency,frequency_std,shape,mode\n14.2,0.05,0.4 1.0,1\n88.9,,-0.7+0.01i 1,2\n"
    )
    text = good.read_text()
    start, end = text.index('use = "fit"'), text.index('[[recordings]]\nkind = "time"')
    channels = text[text.index("channels = ", start) : text.index("rows = ", start)]
    text = text[:start] + 'file = "modes.csv"\n' + channels + text[end:]
    assert text.count(BEAMS) == 1
    good.write_text(text.replace(BEAMS, 'rows = { file = "beams.csv" }'))
    spec = load_problem(good)
    beam = spec.model.elements[0]
    assert beam.type == "beam3d"
    assert [(r.id, r.nodes, r.group, r.orientation, r.material) for r in beam.rows] == [
        (1, (1, 2), "root", (0.0, 0.0, 1.0), "steel"),
        (2, (2, 3), "7", None, "steel"),
    ]
    modes = spec.recordings[0]
    assert modes.kind == "modes" and [m.frequency for m in modes.rows] == [14.2, 88.9]
    assert modes.rows[1].shape == ((-0.7, 0.01), 1) and modes.rows[1].frequency_std is None


@pytest.mark.parametrize(
    ("csv", "key", "words"),
    [
        ("id,nodes\n1,1 2\n2,2 x\n", "line 3, column nodes[1]", ("'x' is not a whole number",)),
        (
            "id,nodes,grp\n1,1 2,a\n2,2 3,b\n",
            "line 1, column grp",
            ("unknown column 'grp'", "Did you mean 'group'?"),
        ),
        (
            "# of the drawing\nid,node 1,node 2\n1,1,2\n2,2,3\n",
            "line 2, column nodes",
            ("is missing. Add a column `nodes`", "One cell holds them all", "`1 2`"),
        ),
        (
            "id,nodes\n1,1 2\n\n# note\n2,2 93\n",
            "line 5, column nodes",
            ("node 93, which does not exist",),
        ),
        ("id,nodes\n1,1 2\n1,2 3\n", "line 3, column id", ("element 1 appears twice",)),
        ("", "model.elements[0].rows.file", ("is empty (0 bytes)",)),
        ("id,nodes\n", "model.elements[0].rows", ("is empty",)),
        ("id,id\n1,1\n", "model.elements[0].rows.file", ("repeated column name",)),
        (
            "id,nodes\n1,1 2,3,4\n",
            "model.elements[0].rows.file",
            ("line 2: 4 cells under 2 column names",),
        ),
    ],
)
def test_faults_in_a_csv_file_name_its_line(
    csv: str, key: str, words: tuple[str, ...], spoil: Spoil
) -> None:
    path = spoil((BEAMS, 'rows = { file = "beams.csv" }'))
    (path.parent / "beams.csv").write_text(csv)
    faults = [f for f in check_problem(path) if f.key == key]
    assert faults, [str(f) for f in check_problem(path)]
    for word in words:
        assert word in str(faults[0])
    if key.startswith("line"):
        assert faults[0].file.endswith("beams.csv") and len(faults) == 1


def test_data_sets(spoil: Spoil, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = spoil(('file = "run.csv"', 'file = "run.csv"\ndataset = "shaker"'))
    monkeypatch.delenv("CVXUPDATE_DATA", raising=False)
    (unset,) = check_problem(path)
    assert (
        unset.key == "recordings[1].file"
        and "CVXUPDATE_DATA is not set" in str(unset)
        and "problems/real/README.md" in str(unset)
    )
    monkeypatch.setenv("CVXUPDATE_DATA", str(tmp_path))
    (absent,) = check_problem(path)
    assert "data set 'shaker' is not in" in str(absent)
    (tmp_path / "shaker").mkdir()
    (tmp_path / "shaker" / "run.csv").write_text("1,2\n")
    assert load_problem(path).recordings[1].file == tmp_path / "shaker" / "run.csv"


MATRICES = """
[model]
dofs = ["x"]
{nodes}
[[model.elements]]
type = "matrix"
file = "k.npz"
{labels}
rows = [{{ id = 1, group = "frame", stiffness = "K1" }}, {{ id = 2, stiffness = "K2.mtx" }},
        {{ id = 3, mass = "M" }}]

[[recordings]]
kind = "modes"
rows = [{{ frequency = 4.1, shape = [1.0] }}]
channels = [{{ column = 0, quantity = "displacement", node = 21, dof = "x" }}]

[update]
method = "frequencies"
parameters = [{{ elements = "all", of = "stiffness", each = "element" }}]
"""


def test_matrices_from_another_program(tmp_path: Path) -> None:
    np.savez(tmp_path / "k.npz", K1=np.eye(2), M=np.eye(2))
    (tmp_path / "K2.mtx").write_text("%%MatrixMarket matrix coordinate real symmetric\n2 2 0\n")
    path = tmp_path / "m.toml"
    path.write_text(MATRICES.format(nodes="", labels=""))
    spec = load_problem(path)
    block = spec.model.elements[0]
    assert (
        block.type == "matrix"
        and block.rows[0].labels == "auto"
        and block.rows[2].file == tmp_path / "k.npz"
    )
    assert block.rows[1].stiffness == str(tmp_path / "K2.mtx") and spec.name == "m"
    assert spec.update is not None
    assert [t.name for t in expand_parameters(spec.model, spec.update.parameters)] == [
        "e1.stiffness",
        "e2.stiffness",
    ]
    path.write_text(MATRICES.format(nodes="", labels='labels = ["n21.x", "n22.x"]'))
    assert load_problem(path).model.elements[0].rows[0].labels == ("n21.x", "n22.x")  # type: ignore[union-attr]
    path.write_text(MATRICES.format(nodes="", labels='labels = ["n7.x", "n22,x"]'))
    said = [str(f) for f in check_problem(path)]
    assert any("'n22,x' is not a DOF label" in s for s in said) and any(
        "node 21, which does not exist" in s for s in said
    )
    (tmp_path / "K2.mtx").unlink()
    path.write_text(MATRICES.format(nodes="", labels=""))
    (fault,) = check_problem(path)
    assert fault.key == "model.elements[0].rows[1].stiffness" and "there is no file" in str(fault)


@pytest.mark.skipif(
    not (Path(os.environ.get("CVXUPDATE_DATA", "")) / "smu-modal-data").is_dir(),
    reason="CVXUPDATE_DATA is not set",
)
def test_the_footbridge_can_be_written(tmp_path: Path) -> None:
    rows = ", ".join(
        f'{{ id = {i + 1}, group = "deck {i}", stiffness = "K_Conc{i}" }}' for i in range(1, 12)
    )
    path = tmp_path / "bridge.toml"
    path.write_text(f"""
[model]
dofs = ["x"]
[[model.elements]]
type = "matrix"
dataset = "smu-modal-data"
file = "SteelPedestrianBridgeExp.mat"
rows = [{{ id = 1, stiffness = "K_Frame" }}, {rows}, {{ id = 99, mass = "M0" }}]
[[recordings]]
kind = "modes"
rows = [{{ frequency = 4.06, shape = [0.1, 0.2] }}]
channels = [{{ column = 0, quantity = "displacement", node = 21, dof = "x" }},
            {{ column = 1, quantity = "displacement", node = 22, dof = "x" }}]
[update]
method = "sensitivity"
parameters = [{{ elements = "all", of = "stiffness", each = "element", lower = -1, upper = 10 }}]
""")
    spec = load_problem(path)
    assert (
        spec.model.elements[0].rows[0].file
        == Path(os.environ["CVXUPDATE_DATA"]) / "smu-modal-data/SteelPedestrianBridgeExp.mat"
    )  # type: ignore[union-attr]


@pytest.mark.skipif(not CHALLENGE.is_dir(), reason="the concealed cases are not here")
def test_every_concealed_case_is_valid() -> None:
    files = sorted(CHALLENGE.glob("*/problem.toml"))
    assert files and {p: [str(f) for f in check_problem(p)] for p in files} == {
        p: [] for p in files
    }


def test_the_schema_is_plain_json_and_knows_every_table() -> None:
    text = json.loads(json.dumps(schema()))
    assert set(text["properties"]) == {
        "title",
        "source",
        "model",
        "recordings",
        "update",
        "constraints",
        "regularisation",
        "solver",
        "diagnose",
    }
    spring = text["$defs"]["SpringRow"]
    assert spring["required"] == ["id", "nodes"] and spring["additionalProperties"] is False
    assert any(
        "file" in branch.get("properties", {})
        for branch in text["$defs"]["Model"]["properties"]["nodes"]["anyOf"]
    )
    assert "dataset" in text["$defs"]["FrfRecording"]["properties"]


def test_ten_thousand_elements_load(tmp_path: Path) -> None:
    n = 10_000
    nodes = ",\n".join(
        f"  {{ id = {i}, x = {0.001 * i:.4f}, y = 0.0, z = 0.0 }}" for i in range(n + 1)
    )
    rows = ",\n".join(
        f'  {{ id = {i}, nodes = [{i}, {i + 1}], group = "g{i % 40}" }}' for i in range(n)
    )
    path = tmp_path / "long.toml"
    path.write_text(f"""
[model]
dofs = ["z", "ry"]
nodes = [
{nodes}
]
[model.materials.steel]
E = 2e11
rho = 7850.0
[model.sections.bar]
shape = "circle"
diameter = 0.01
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [
{rows}
]
[[recordings]]
kind = "modes"
rows = [{{ frequency = 4.06 }}]
[update]
method = "frequencies"
parameters = [{{ elements = "all", of = "E", each = "group" }}]
""")
    assert len(load_problem(path).model.elements[0].rows) == n


def test_faults_are_raised_together(spoil: Spoil) -> None:
    path = spoil(("E = 207e9", "E = 0.0"), ("m = 0.35", "m = nan"))
    with pytest.raises(ProblemFileError) as caught:
        load_problem(path)
    assert len(caught.value.faults) == 2 and str(caught.value).count("\n") == 1
