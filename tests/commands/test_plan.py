"""`plan`: places against exhaustive choice, lines and deviations by their laws, files, refusals."""

import csv
import itertools
import json
import sys

import numpy as np
import pytest

from cvxupdate import cli
from cvxupdate.commands.plan import plan
from cvxupdate.commands.plan_lines import information
from cvxupdate.commands.plan_places import crowd, most_telling
from cvxupdate.commands.planned import Options
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.report.plan_page import plan_page
from cvxupdate.spec import spec_of

BEAM = """
title = "Stepped cantilever"
[model]
dofs = ["y", "rz"]
supports = [{ nodes = [1], dofs = ["y", "rz"] }]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.21 }, { id = 3, x = 0.36 }, { id = 4, x = 0.6 },
         { id = 5, x = 0.71 }, { id = 6, x = 0.9 }, { id = 7, x = 1.15 }]
[model.materials.steel]
E = 2.1e11
rho = 7800.0
[model.sections.bar]
shape = "general"
A = 4.0e-4
Iz = 1.3e-8
[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2], group = "root" }, { id = 2, nodes = [2, 3], group = "root" },
        { id = 3, nodes = [3, 4], group = "mid" }, { id = 4, nodes = [4, 5], group = "mid" },
        { id = 5, nodes = [5, 6], group = "tip" }, { id = 6, nodes = [6, 7], group = "tip" }]
[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [7], m = 0.4, group = "lump" }]
"""
UPDATE = """
[update]
method = "rfm"
[[update.parameters]]
of = "stiffness"
groups = ["root", "mid", "tip"]
each = "group"
[[update.parameters]]
of = "mass"
groups = ["lump"]
each = "group"
"""
TWINS = """
title = "Two equal pendulums of springs"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [
  { id = 1, nodes = [1], k = 1.0e5, group = "a" },
  { id = 2, nodes = [2], k = 4.0e5, group = "b" },
  { id = 3, nodes = [3], k = 1.0e5, group = "c" },
  { id = 4, nodes = [1], k = 1.0e4, group = "d" },
  { id = 5, nodes = [1, 2], k = 100.0, group = "e" },
  { id = 6, nodes = [2, 3], k = 100.0, group = "e" },
  { id = 7, nodes = [3], k = 1.0e4, group = "f" },
]
[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 1.0 }, { id = 12, nodes = [2], m = 1.0 },
        { id = 13, nodes = [3], m = 1.0 }]
[update]
method = "rfm"
[[update.parameters]]
of = "stiffness"
groups = ["a", "d", "b"]
each = "group"
"""


@pytest.fixture
def beam(tmp_path):
    path = tmp_path / "beam.toml"
    path.write_text(BEAM + UPDATE, encoding="utf-8")
    return path


@pytest.fixture
def bare(tmp_path):
    path = tmp_path / "bare.toml"
    path.write_text(BEAM, encoding="utf-8")
    return path


def determinant(phi, rows):
    return np.linalg.det(phi[rows].T @ phi[rows])


def test_independent_sensors_are_nearly_the_best_of_all(bare):
    """|ΦᵀΦ| of the proposed places against every choice of as many."""
    found = plan(bare, Options(sensors=4, modes=3))
    model = build_model(spec_of(bare))
    phi = model_modes(model, 3).shapes
    places = [model.place[f"n{n}.y"] for n in range(2, 8)]
    by = {s.rule: s for s in found.sensors}
    ours = determinant(phi, [model.place[v] for v in by["effective-independence"].labels])
    every = [determinant(phi, list(c)) for c in itertools.combinations(places, 4)]
    assert ours >= 0.9 * max(every)
    assert all(v.endswith(".y") for s in found.sensors for v in s.labels)


def test_the_exciter_drives_the_mode_that_it_drives_least_most(bare):
    found = plan(bare, Options(exciters=1, modes=3))
    model = build_model(spec_of(bare))
    phi = np.abs(model_modes(model, 3).shapes)
    places = [model.place[f"n{n}.y"] for n in range(2, 8)]
    relative = (phi[places] / phi[places].max(axis=0)).min(axis=1)
    assert found.exciters.labels == (model.labels[places[int(np.argmax(relative))]],)
    assert np.isclose(min(found.exciters.drive), relative.max())
    assert max(found.indicator.dips) < 0.2  # one exciter, modes far apart: pure


def test_the_best_sensors_for_parameters_are_nearly_the_best_of_all(beam):
    found = plan(beam, Options(sensors=3, modes=3, exciters=1))
    model = build_model(spec_of(beam))
    told = information(
        model, np.array(found.frequencies), found.exciters.labels, Options(exciters=1, modes=3)
    )

    def left(rows):
        return np.trace(np.linalg.inv(400.0 * np.eye(told.shape[1]) + told[list(rows)].sum(axis=0)))

    every = [left(c) for c in itertools.combinations(range(len(told)), 3)]
    assert left(most_telling(told, 3)) <= 1.1 * min(every)
    assert found.sensors[0].rule == "a-optimal"
    assert found.sensors[0].deviation <= min(s.deviation for s in found.sensors[1:]) * 1.2


def test_deviations_follow_the_noise_and_say_what_accuracy_needs(beam):
    one, three = (plan(beam, Options(noise=n, modes=3)) for n in (0.01, 0.03))
    between = [x.rule for x in one.lines].index("between")  # its lines do not know the noise
    a, b = one.lines[between].deviations, three.lines[between].deviations
    assert np.allclose(np.array(b), 3.0 * np.array(a), rtol=1e-6)
    assert np.isclose(one.lines[between].bears, three.lines[between].bears)
    assert np.isclose(one.lines[between].bears, 0.01 * 0.05 / max(a))
    assert [x.rule for x in one.lines] == ["best", "between", "log-function"]
    total = {x.rule: np.sum(np.square(x.deviations)) for x in one.lines}
    assert total["best"] <= min(total.values()) * 1.0001


def test_close_modes_need_two_exciters_and_parallel_springs_stay_open(tmp_path):
    path = tmp_path / "twins.toml"
    path.write_text(TWINS, encoding="utf-8")
    found = plan(path, Options(modes=3, sensors=3))
    assert crowd(np.array(found.frequencies)) == 2 and len(found.exciters.labels) >= 2
    assert min(found.exciters.purity) > 0.99
    open_ = dict(zip(found.parameters, found.lines[0].deviations, strict=True))
    assert sum(not np.isfinite(d) for d in open_.values()) == 2  # "a" and "d" act as one
    single = plan(path, Options(modes=3, sensors=3, exciters=1))
    assert any("cannot separate them" in n for n in single.notes)
    assert "leave 2 parameters open" in plan_page(found)


def test_the_command_writes_page_table_and_json(beam, monkeypatch, capsys):
    monkeypatch.chdir(beam.parent)
    monkeypatch.setattr(sys, "argv", ["cvxupdate", "plan", "beam.toml", "--modes", "3"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 0 and "5 sensors and 1 exciter" in capsys.readouterr().out
    folder = beam.parent / "out/beam/plan"
    data = json.loads((folder / "result.json").read_text())
    rows = list(csv.DictReader((folder / "plan.csv").read_text().splitlines()))
    sensors = [r["dof"] for r in rows if r["kind"] == "sensor"]
    assert sensors == data["sensors"][0]["labels"] and float(rows[0]["x"]) > 0.0
    assert [float(r["frequency"]) for r in rows if r["kind"] == "line"] == pytest.approx(
        data["lines"][0]["lines"]
    )
    page = (folder / "report.html").read_text()
    assert "cvxupdate plan --modes 3 beam.toml" in page and page.count("<svg") == 3


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"sensors": 2}, "2 sensors for 6 modes"),
        ({"sensors": 40}, "40 sensors for 6 modes"),
        ({"exciters": 9, "modes": 3}, "there are 6 free translations"),
    ],
)
def test_what_the_model_cannot_give_is_refused(bare, options, says):
    with pytest.raises(InputError, match=says):
        plan(bare, Options(**options))


def test_options_are_checked():
    with pytest.raises(InputError, match="no fraction"):
        Options(noise=0.0)
    with pytest.raises(InputError, match="give the lower end"):
        Options(band=(5.0, 1.0))
    with pytest.raises(InputError, match="give 1 or more"):
        Options(sensors=0)
