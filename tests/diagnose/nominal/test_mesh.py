"""The mesh error taken out: against the same model on much finer meshes, of slender bars, stocky
ones that deform in shear, and plates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.diagnose.nominal.mesh import (
    NONE,
    mesh_error,
    shearing,
    stocky,
)
from cvxupdate.diagnose.settings import ANOTHER_MODE
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.fe.refinement import refined
from tests.cases.effects import PLATE, problem

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


def finest(spec, times):
    """The model on a mesh 2^times as fine."""
    for _ in range(times):
        spec = replace(spec, model=refined(spec.model).model, update=None)
    return build_model(spec)


def load(folder, text):
    from cvxupdate.spec import load_problem

    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


@pytest.mark.parametrize(
    ("text", "sheared", "order"), [("bar", False, 4), (STOCKY, False, 4), (STOCKY, True, 2)]
)
def test_what_is_taken_out_is_the_distance_to_a_much_finer_mesh(
    bar, tmp_path, text, sheared, order
):
    spec, model = bar if text == "bar" else load(tmp_path, text)
    top = 1.1 * model_modes(model, 4).flexible().frequencies[-1]
    error = mesh_error(spec, model, top, sheared=sheared)
    change = shearing if sheared else (lambda m: m)
    coarse, true = (
        model_modes(change(m), 4).flexible().frequencies for m in (model, finest(spec, 5))
    )
    left = coarse * (1.0 + error.at(coarse)) / true - 1.0
    assert error.order == order
    assert np.all(np.abs(left) <= error.missed(top)) and error.missed(top) < 0.5 * error.worst(top)
    assert np.abs(coarse / true - 1.0).max() == pytest.approx(error.worst(top), rel=0.35)


def test_beams_without_shear_have_one_mesh_error(bar):
    _, model = bar
    assert not stocky(model)
    assert stocky(shearing(model)) == (0.11 < 4 * 0.04)  # 40 mm wide: the deepest side counts


def test_modes_that_differ_much_are_not_taken_for_one(tmp_path):
    """High modes of a coarse sheet look like others of the fine one at the few shared nodes."""
    spec = problem(tmp_path, PLATE)
    error = mesh_error(spec, build_model(spec), 1e6)
    assert error.inner is None
    assert len(error.shift) and np.all(np.abs(error.shift) <= ANOTHER_MODE)


def test_nothing_to_divide(chain):
    assert mesh_error(*chain, 100.0) is NONE and mesh_error(*chain, 100.0, sheared=True) is NONE


CORDS = """
[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 91, nodes = [2], k = 3e3 }, { id = 92, nodes = [5], k = 4e3 }]
[[model.elements]]
type = "mass"
rows = [{ id = 93, nodes = [4], m = 0.05 }]
"""


def test_beside_cords_modes_take_the_error_of_what_they_are_made_of(tmp_path):
    """A free bar has two rigid-body modes; on cords these are its first two modes, without error of
    the mesh, and what was its first is its third, with its own."""
    free = STOCKY[: STOCKY.index("[[model.supports]]")]
    folders = [tmp_path / name for name in ("free", "hung")]
    for folder in folders:
        folder.mkdir()
    spec, model = load(folders[0], free)
    hung_spec, hung = load(folders[1], free + CORDS)
    top = 1.1 * model_modes(model, 4).flexible().frequencies[-1]
    error = mesh_error(spec, model, top)
    coarse = model_modes(hung, 6)
    true = model_modes(finest(hung_spec, 4), 6).frequencies
    assert coarse.rigid == 0
    moved = error.taken_out(hung, coarse, error.rows(hung)).frequencies
    left, before = moved / true - 1.0, coarse.frequencies / true - 1.0
    assert np.all(np.abs(left[:2]) < 1e-4)
    assert np.all(np.abs(left[2:]) < 0.25 * np.abs(before[2:])), (left, before)
    np.testing.assert_array_equal(
        NONE.taken_out(hung, coarse, NONE.rows(hung)).eigenvalues, coarse.eigenvalues
    )


def test_a_kinked_mode_has_no_more_than_the_largest_error(tmp_path):
    """A bar that is nearly a hinge amid bends far from any mode of the whole one."""
    spec, model = load(tmp_path, STOCKY)
    error = mesh_error(spec, model, 1.1 * model_modes(model, 4).flexible().frequencies[-1])
    rng = np.random.default_rng(1)
    modes = model_modes(model, 4)
    mixed = replace(modes, shapes=modes.shapes @ np.linalg.qr(rng.normal(size=(4, 4)))[0])
    by = error.taken_out(model, mixed, error.rows(model)).frequencies / mixed.frequencies - 1.0
    assert np.all(np.abs(by) <= 1.000001 * np.abs(error.shift).max())


def jointed(x, joint, k):
    """Eigenvalues and shapes of the stocky bar on nodes ``x`` with a turning spring (N·m/rad) in
    node number ``joint``: Euler-Bernoulli with rotary inertia, by hand. DOFs (w, -dw/dx) node by
    node, the far side's rotation at the joint last; the first node is held."""
    E, rho, b = 207e9, 7850.0, 0.06
    A, I, n = b * b, b**4 / 12.0, 2 * len(x) + 1
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for e, h in enumerate(np.diff(x)):
        d = [2 * e, n - 1 if e == joint else 2 * e + 1, 2 * e + 2, 2 * e + 3]
        s = np.diag([1.0, -h, 1.0, -h])
        bend = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
        move = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
        turn = [[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]
        K[np.ix_(d, d)] += E * I / h**3 * (s @ bend @ s)
        M[np.ix_(d, d)] += (
            s @ (rho * A * h / 420 * np.array(move) + rho * I / 30 / h * np.array(turn)) @ s
        )
    sides = [2 * joint + 1, n - 1]
    K[np.ix_(sides, sides)] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    values, shapes = scipy.linalg.eigh(K[2:, 2:], M[2:, 2:])
    return values[:6], shapes[:, :6]


@pytest.mark.parametrize("k", [1e9, 1e5, 1e3])
def test_beside_a_hinge_modes_have_the_error_of_their_own_shape(tmp_path, k):
    """Shares of mass in modes without a kink took off up to 0.4 % where there was 0.3 % more."""
    spec, model = load(tmp_path, STOCKY)
    error = mesh_error(spec, model, 1.1 * model_modes(model, 4).flexible().frequencies[-1])
    x = np.array([0.0, 0.09, 0.2, 0.31, 0.4, 0.52])
    values, shapes = jointed(x, 3, k)
    fine = np.interp(np.arange(81) / 16.0, np.arange(6), x)
    true, _ = jointed(fine, 48, k)
    (block,) = model.blocks
    dofs = block.dofs.copy()
    dofs[3, np.flatnonzero(dofs[3] == 5)] = model.size  # the far side of node 4
    grown = replace(model, blocks=(replace(block, dofs=dofs),))
    modes = Modes(values, shapes, 0)
    moved = error.taken_out(grown, modes, np.arange(model.size)).eigenvalues
    left, before = np.sqrt(moved / true)[:4] - 1.0, np.sqrt(values / true)[:4] - 1.0
    assert before.max() > 5e-3
    assert np.all(np.abs(left) <= error.rest(before) + 1e-6), (left, before)


def test_modes_far_above_the_band_keep_what_they_give_statically(tmp_path):
    spec, model = load(tmp_path, STOCKY)
    modes = model_modes(model, 10)
    error = mesh_error(spec, model, 1.1 * modes.frequencies[1])
    ratio = error.taken_out(model, modes, error.rows(model)).eigenvalues / modes.eigenvalues
    far = modes.frequencies > 2.0 * 1.1 * modes.frequencies[1]
    assert far.any() and np.all(ratio[far] == 1.0) and np.all(ratio[:2] < 1.0)
