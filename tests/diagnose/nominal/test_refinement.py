"""The mesh of the analysis model: against the same model on much finer meshes, of slender bars,
stocky ones that deform in shear, and plates; places and numbers as in the file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.nominal.refinement import (
    PLAIN,
    Mesh,
    Wanted,
    fine_enough,
    mesh_lines,
    mesh_notes,
    shift_between,
    wants_finer,
)
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined

STOCKY = """
title = "Stocky bar"
[model]
dofs = ["z", "ry"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.09 }, { id = 3, x = 0.2 }, { id = 4, x = 0.31 },
         { id = 5, x = 0.4 }, { id = 6, x = 0.52 }]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.06
height = 0.06
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [2, 3] }, { id = 3, nodes = [3, 4] },
        { id = 4, nodes = [4, 5] }, { id = 5, nodes = [5, 6] }]
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
"""
PRECISION = 1e-5


def load(folder, text):
    from cvxupdate.spec import load_problem

    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


def found(spec, model, top, sheared=False):
    wanted = Wanted(top, PRECISION, 1e-4, lambda a, b: shift_between(a, b, top), sheared)
    return fine_enough(spec, model, wanted)


@pytest.mark.parametrize(("text", "sheared"), [("bar", False), (STOCKY, False), (STOCKY, True)])
def test_what_is_left_is_nothing_beside_a_much_finer_mesh(bar, tmp_path, text, sheared):
    """Of the model as it stands; and, where it may be asked, of one whose bars deform in shear,
    although the analysis model was made of one whose bars do not."""
    spec, model = bar if text == "bar" else load(tmp_path, text)
    top = 1.1 * model_modes(model, 4).flexible().frequencies[-1]
    mesh = found(spec, model, top, sheared)
    for change in (lambda m: m, *([shearing] if sheared else [])):
        finest = build_model(
            replace(spec, model=refined(spec.model, lambda block, row: 32).model, update=None)
        )
        true = model_modes(change(finest), 3).flexible().frequencies
        own = model_modes(change(mesh.on(model)), 3).flexible().frequencies
        coarse = model_modes(change(model), 3).flexible().frequencies
        left = np.abs(own[:3] / true[:3] - 1.0).max()
        assert left <= 1e-4 and left <= 0.05 * np.abs(coarse[:3] / true[:3] - 1.0).max()


def test_the_file_s_shift_is_told_where_it_matters(bar):
    spec, model = bar
    top = 1.1 * model_modes(model, 4).flexible().frequencies[-1]
    mesh = found(spec, model, top)
    assert mesh.shift == pytest.approx(shift_between(model, mesh.on(model), top))
    assert mesh_lines(replace(mesh, shift=0.02))[0].startswith(
        "The mesh of the file shifts natural frequencies by up to 2 %"
    )
    assert mesh_notes(replace(mesh, shift=0.02)) and not mesh_lines(PLAIN) and not mesh_notes(PLAIN)


def test_nothing_to_divide(chain):
    spec, model = chain
    mesh = found(spec, model, 100.0)
    assert mesh == Mesh() and mesh.on(model) is model


def test_plane_frames_want_what_lies_within_their_corners(tmp_path):
    bent = STOCKY.replace("{ id = 6, x = 0.52 }", "{ id = 6, x = 0.4, z = 0.12 }")
    plane = bent.replace('dofs = ["z", "ry"]', 'dofs = ["x", "z", "ry"]').replace("3d", "2d")
    frame, bar, space = (load(tmp_path, x)[1] for x in (plane, STOCKY, plane.replace("2d", "3d")))
    assert wants_finer(frame, False) and not wants_finer(frame, True)
    assert not wants_finer(bar, False) and not wants_finer(space, False)
