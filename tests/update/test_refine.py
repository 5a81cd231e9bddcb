"""`refine` in [update]: a coarse mesh does not bend the parameter."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.spec import load_problem
from cvxupdate.study import run

ROD = """
title = "Rod of three elements"
[model]
dofs = ["x"]
nodes = [{{ id = 1, x = 0.0 }}, {{ id = 2, x = 0.3 }}, {{ id = 3, x = 0.7 }}, {{ id = 4, x = 1.0 }}]
[model.materials.steel]
E = {E}
rho = 7850.0
[model.sections.bar]
shape = "circle"
diameter = 0.01
[[model.elements]]
type = "rod"
material = "steel"
section = "bar"
rows = [{{ id = 1, nodes = [1, 2] }}, {{ id = 2, nodes = [2, 3] }}, {{ id = 3, nodes = [3, 4] }}]
[[model.supports]]
nodes = [1]
dofs = ["x"]
[[recordings]]
kind = "modes"
rows = [{{ frequency = {f}, frequency_std = 0.1, mode = 2 }}]
[update]
method = "{method}"
{refine}
parameters = [{{ elements = "all", of = "E" }}]
"""


def problem(folder, refine="", E=200e9, f=1000.0, method="frequencies"):
    path = folder / "problem.toml"
    path.write_text(ROD.format(E=E, f=f, refine=refine, method=method), encoding="utf-8")
    return path


def test_a_coarse_mesh_does_not_bend_the_parameter(tmp_path):
    """A rod of 210 GPa measured on a fine mesh, drawn with 200: its second frequency is several
    per cent too high with three elements, which E has to make up for."""
    spec = load_problem(problem(tmp_path, E=210e9))
    fine = refined(spec.model, lambda block, row: 40).model
    f = float(model_modes(build_model(replace(spec, model=fine, update=None)), 2).frequencies[1])
    found = {
        key: run(problem(tmp_path, refine, f=f)).parameters[0].after
        for key, refine in (("file", ""), ("fine", "refine = 8"))
    }
    assert found["fine"] == pytest.approx(210e9, rel=2e-3)
    assert found["file"] < 0.95 * 210e9


def test_ceam_keeps_the_matrices_of_the_file(tmp_path):
    with pytest.raises(InputError, match=r"update\.refine: ceam updates the matrices of the file"):
        run(problem(tmp_path, "refine = 8", method="ceam"))
