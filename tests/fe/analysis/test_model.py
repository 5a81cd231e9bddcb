"""The analysis model against the file's model on a much finer mesh: frequencies, as it stands and
where a patch changes, on supports and where one gives way; numbers, mass and rigid motions kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.analysis import model as analysis
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.spec import Spec, load_problem

PLATE = """
title = "Plate"
[model]
dofs = ["z", "rx", "ry"]
{nodes}
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.skin]
shape = "plate"
thickness = 0.003
{elements}
{supports}
"""
FRAME = """
title = "Frame with unequal legs, a truss across"
[model]
dofs = ["x", "y", "z", "rx", "ry", "rz"]
nodes = [{ id = 9, x = 0.0 }, { id = 2, x = 0.0, z = 0.4 }, { id = 5, x = 0.3, z = 0.5, y = 0.1 },
         { id = 4, x = 0.55, z = 0.05 }]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.02
height = 0.012
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [9, 2] }, { id = 2, nodes = [2, 5] }, { id = 3, nodes = [5, 4] }]
[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [5], m = 0.2 }]
[[model.supports]]
nodes = [9, 4]
dofs = ["x", "y", "z", "rx", "ry", "rz"]
"""
ROD = """
title = "Rod"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.3 }, { id = 3, x = 0.7 }, { id = 4, x = 1.0 }]
[model.materials.steel]
E = 207e9
rho = 7850.0
[model.sections.bar]
shape = "circle"
diameter = 0.01
[[model.elements]]
type = "rod"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [2, 3] }, { id = 3, nodes = [3, 4] }]
"""
HELD = '[[model.supports]]\nnodes = [1, 6, 11, 16]\ndofs = ["z", "rx", "ry"]'
EASED = HELD + '\n[[model.supports]]\nnodes = [5, 10]\ndofs = ["z"]'


def plate(supports: str = "") -> str:
    """4 x 3 elements of unequal width."""
    x, y = (0.0, 0.12, 0.22, 0.36, 0.47), (0.0, 0.11, 0.2, 0.33)
    nodes = [
        f"{{ id = {1 + i + 5 * j}, x = {a}, y = {b} }}"
        for j, b in enumerate(y)
        for i, a in enumerate(x)
    ]
    rows = []
    for e in range(12):
        n = 1 + e % 4 + 5 * (e // 4)
        rows.append(f"{{ id = {e + 1}, nodes = [{n}, {n + 1}, {n + 6}, {n + 5}] }}")
    block = '[[model.elements]]\ntype = "plate"\nmaterial = "steel"\nsection = "skin"\n'
    return PLATE.format(
        nodes=f"nodes = [{', '.join(nodes)}]",
        elements=f"{block}rows = [{', '.join(rows)}]",
        supports=supports,
    )


def read(folder: Path, text: str) -> tuple[Spec, Model]:
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


def limit(spec: Spec, grow=lambda m: m, p=None, count: int = 8, parts: int = 12) -> np.ndarray:
    """Frequencies on two fine meshes, extrapolated."""
    found = []
    for n in (parts // 2, parts):
        fine = replace(spec, model=refined(spec.model, lambda b, r, n=n: n).model, update=None)
        found.append(model_modes(grow(build_model(fine)), count, p).flexible().frequencies[:count])
    return (4.0 * found[1] - found[0]) / 3.0


def own(model: Model, p=None, count: int = 8) -> np.ndarray:
    return model_modes(model, count, p).flexible().frequencies[:count]


@pytest.mark.parametrize("supports", ["", HELD, EASED])
def test_a_plate_has_the_frequencies_of_a_fine_mesh(tmp_path, supports):
    spec, file = read(tmp_path, plate(supports))
    true, found = limit(spec), analysis_of(spec, file, 8)
    model = found.on(file)
    coarse, fine = np.abs(own(file) / true - 1.0), np.abs(own(model) / true - 1.0)
    assert fine.max() < 6e-4 and coarse.max() > 40.0 * fine.max()
    assert model.total_mass() == pytest.approx(file.total_mass(), rel=1e-5)
    assert model_modes(model, 3).rigid == model_modes(file, 3).rigid == (0 if supports else 3)
    assert model.labels[: file.size] == file.labels
    assert [b.ids.tolist() for b in model.blocks] == [b.ids.tolist() for b in file.blocks]


def test_what_two_meshes_share_is_made_once(tmp_path, monkeypatch):
    spec, file = read(tmp_path, plate())
    made, parts_of = [], analysis.fine_of

    def counted(spec, file, parts):
        made.append(parts["plate"])
        return parts_of(spec, file, parts)

    monkeypatch.setattr(analysis, "fine_of", counted)
    known = {}
    found = [analysis_of(spec, file, n, True, known) for n in (4, 8)]
    assert sorted(made) == [2, 4, 8]
    alone = analysis_of(spec, file, 8, True)
    np.testing.assert_array_equal(own(found[1].on(file)), own(alone.on(file)))


def test_so_has_one_with_a_patch_of_other_thickness(tmp_path):
    """The basis was made of the plate as drawn: thickness jumps at the edges of elements."""
    spec, file = read(tmp_path, plate(HELD))

    def grow(model: Model) -> Model:
        return append_parameters(model, [limited("t", "thickness", [6, 7, 10, 11], (-0.5, 3.0))])

    p = np.array([0.4])
    true = limit(spec, grow, p)
    model = grow(analysis_of(spec, file, 8).on(file))
    assert np.abs(own(model, p) / true - 1.0).max() < 3e-4


def test_a_support_that_is_taken_away_sets_its_edges_free(tmp_path):
    """The same pieces stand on a model with other supports."""
    spec, file = read(tmp_path, plate(HELD))
    free_spec, free = read(tmp_path, plate(HELD.replace("1, 6, 11, 16", "6, 11, 16")))
    model = analysis_of(spec, file, 8).on(free)
    assert model.size > analysis_of(spec, file, 8).on(file).size + 3
    assert np.abs(own(model) / limit(free_spec) - 1.0).max() < 5e-3


@pytest.mark.parametrize(("text", "closer"), [(FRAME, 30.0), (ROD, 30.0)])
def test_lines_have_the_frequencies_of_a_fine_mesh(tmp_path, text, closer):
    spec, file = read(tmp_path, text)
    count = 6 if text is FRAME else 3
    fine = replace(spec, model=refined(spec.model, lambda b, r: 40).model, update=None)
    true = own(build_model(fine), count=count)
    model = analysis_of(spec, file, 8).on(file)
    coarse, left = (np.abs(own(m, count=count) / true - 1.0).max() for m in (file, model))
    assert left < 1e-3 and coarse > closer * left


def test_nothing_grows_with_the_number_of_parts(tmp_path):
    spec, file = read(tmp_path, plate(HELD))
    few, many = (analysis_of(spec, file, n).on(file) for n in (4, 16))
    assert few.labels == many.labels
    assert [b.dofs.shape for b in few.blocks] == [b.dofs.shape for b in many.blocks]


def test_coordinates_can_be_left_out(tmp_path):
    """Frequencies rise as a space is made smaller (Rayleigh)."""
    spec, file = read(tmp_path, plate(HELD))
    whole = analysis_of(spec, file, 8)
    less = whole.only(frozenset(whole.families[:2]))
    assert less.on(file).size < whole.on(file).size
    assert np.all(own(less.on(file)) >= own(whole.on(file)) * (1.0 - 1e-9))


def test_nothing_to_divide(tmp_path):
    spec, model = read(
        tmp_path,
        FRAME.replace('type = "beam3d"', 'type = "spring"').replace(
            'material = "steel"\nsection = "bar"\n', 'dof = "x"\nk = 1e5\n'
        ),
    )
    assert analysis_of(spec, model, 8) is None


def test_fewer_than_four_parts_tell_no_limit(tmp_path):
    spec, file = read(tmp_path, plate(HELD))
    with pytest.raises(ModelError, match="at least 4 parts, .* got 2"):
        analysis_of(spec, file, 2)
    assert analysis_of(spec, file, 4) is not None
