"""What commands write: the updated model runs again from where it lies, and no file tells whose
disk it was written on."""

from __future__ import annotations

import json
import shutil
import socket
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate import cli, study
from cvxupdate.fe.build import build_model
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.report import run_files
from cvxupdate.report.words import verdict
from cvxupdate.spec import load_problem
from cvxupdate.update.score import caveats

BEAM = """
title = "Cantilever with a lump"
[model]
dofs = ["y", "rz"]
materials = { steel = { E = 210e9, rho = 7850 } }
sections = { bar = { shape = "rectangle", width = 0.008, height = 0.04 } }
supports = [{ nodes = [1], dofs = ["y", "rz"] }]
damping = { kind = "structural", eta = 0.02 }
nodes = [NODES]
[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = [BEAMS]
[[model.elements]]
type = "mass"
rows = [{ id = 90, nodes = [4], m = 0.3 }]
[[recordings]]
kind = "frf"
file = "frf.npz"
response = "acceleration"
[update]
method = "rfm"
parameters = [{ elements = [90], of = "m" }]
"""


def _beam(folder: Path) -> Path:
    """The problem with the recordings of a beam whose lump is 3 % heavier."""
    nodes = ", ".join(f"{{ id = {k + 1}, x = {0.8 * k / 6} }}" for k in range(7))
    beams = ", ".join(f"{{ id = {k}, nodes = [{k}, {k + 1}] }}" for k in range(1, 7))
    path = folder / "problem.toml"
    folder.mkdir(parents=True)
    np.savez(folder / "frf.npz", frequency=[0.0])
    path.write_text(BEAM.replace("NODES", nodes).replace("BEAMS", beams), encoding="utf-8")
    model, f = build_model(load_problem(path)), np.arange(4.0, 400.0, 4.0)
    places = np.array([model.labels.index(name) for name in ("n4.y", "n6.y", "n7.y")])
    H = frequency_responses(model, f, places, places[2:], "acceleration", np.array([0.03]))
    rng = np.random.default_rng(5)
    noise = 0.01 * np.abs(H) * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
    arrays = {"response_node": [4, 6, 7], "response_dof": [2, 2, 2]}
    arrays |= {"reference_node": [7], "reference_dof": [2]}
    np.savez(folder / "frf.npz", frequency=f, H=H + noise, **arrays)
    return path


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which `run` was called, the problem named by its absolute path."""
    path = _beam(tmp_path / "a" / "beam")
    monkeypatch.chdir(tmp_path / "a")
    monkeypatch.setattr(sys, "argv", ["cvxupdate", "run", str(path)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 0
    return tmp_path / "a"


def test_the_updated_model_runs_again_from_where_it_lies(ran: Path, tmp_path: Path) -> None:
    """Its paths are relative, so the folder may move together with the recordings."""
    shutil.move(ran, tmp_path / "b")
    out = tmp_path / "b" / "out" / "beam" / "run"
    first = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert first["parameters"][0]["after"] == pytest.approx(0.309, rel=2e-3)
    again = study.run(out / "updated" / "problem.toml")
    assert again.parameters[0].before == pytest.approx(first["parameters"][0]["after"], rel=1e-12)
    error = again.fit["fit"]["frf_error"]["before"]
    assert error == pytest.approx(first["fit"]["fit"]["frf_error"]["after"], rel=1e-6)


def test_no_file_says_whose_disk_it_was_on(ran: Path, tmp_path: Path) -> None:
    texts = {p: p.read_text(encoding="utf-8") for p in (ran / "out").rglob("*.*") if p.is_file()}
    assert len(texts) == 3
    for path, text in texts.items():
        for word in (str(tmp_path), str(Path.home()) + "/", socket.gethostname()):
            assert word not in text, (path.name, word)


def test_an_error_that_grew_is_said(ran: Path) -> None:
    """A model that is close fits its chosen lines better and the resonances between them worse: an
    update may converge and be no improvement."""
    updated = study.run(ran / "beam" / "problem.toml")
    assert updated.caveats == ()
    worse = replace(updated, fit={"fit": {"frf_error": {"before": 0.028, "after": 0.088}}})
    (said,) = caveats(worse, True)
    assert "grew from 0.028 to 0.088" in said and 'frequency_points = "all"' in said
    hardly = {"fit": {"frequency_error_percent_mean": {"before": 0.008377, "after": 0.008445}}}
    assert caveats(replace(updated, fit=hardly), True) == ()
    much = {"fit": {"frequency_error_percent_mean": {"before": 0.5, "after": 0.9}}}
    assert "grew from 0.5 % to 0.9 %" in caveats(replace(updated, fit=much), True)[0]
    (other,) = caveats(worse, False)
    assert "frequency_points" not in other
    shown = verdict(replace(worse, caveats=(said,)))
    assert shown.tone == "fair" and said in shown.sentences
    assert json.loads(run_files(replace(worse, caveats=(said,)))[1])["caveats"] == [said]
