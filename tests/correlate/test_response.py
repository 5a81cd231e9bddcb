"""Responses by modes and static corrections against dense inversion, for every kind of damping."""

import numpy as np
import pytest

from cvxupdate.correlate import model_frf
from cvxupdate.correlate import response as room
from cvxupdate.errors import InputError
from cvxupdate.fe.modes import model_modes
from cvxupdate.study import open_problem

BEAM = """
title = "beam"
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.m]
E = 70e9
nu = 0.3
rho = 2700.0
[model.sections.s]
shape = "rectangle"
width = 0.03
height = 0.004
[[model.elements]]
type = "beam3d"
material = "m"
section = "s"
rows = [{rows}]
[[model.elements]]
type = "dashpot"
dof = "z"
rows = [{{ id = 900, nodes = [7], c = {c} }}]
{more}
"""
SUPPORT = '[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n'


def beam(folder, more, c=0.0, elements=100):
    x = np.cumsum(np.r_[0.0, 0.006 + 0.003 * np.sin(np.arange(elements))])
    nodes = ", ".join(f"{{ id = {i + 1}, x = {v:.9f} }}" for i, v in enumerate(x))
    rows = ", ".join(f"{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}] }}" for i in range(elements))
    path = folder / "problem.toml"
    path.write_text(BEAM.format(nodes=nodes, rows=rows, c=c, more=more), encoding="utf-8")
    return open_problem(path)[1]


def dense(model, frequency, responses, references, zeta=None):
    m = model.matrices()
    K, M, C, D = (A.toarray() for A in (m.K, m.M, m.C, m.D))
    if zeta is not None:
        modes = model_modes(model, model.size).flexible()
        V = M @ modes.shapes
        C = C + (V * (2 * zeta * np.sqrt(modes.eigenvalues))) @ V.T
    w = 2 * np.pi * frequency
    return np.array(
        [
            np.linalg.inv(K + 1j * D + 1j * v * C - v**2 * M)[np.ix_(responses, references)]
            for v in w
        ]
    )


@pytest.mark.parametrize(
    ("more", "c", "zeta"),
    [
        (SUPPORT + '[model.damping]\nkind = "structural"\neta = 0.01', 0.0, None),
        (SUPPORT + '[model.damping]\nkind = "rayleigh"\nalpha = 1.0\nbeta = 1e-6', 3.0, None),
        (SUPPORT + '[model.damping]\nkind = "modal"\nzeta = 0.005', 0.0, 0.005),
        (
            '[model.damping]\nkind = "structural"\neta = 0.02',
            0.5,
            None,
        ),  # free: three… two rigid-body modes in the plane
    ],
)
def test_agrees_with_dense_inversion(tmp_path, more, c, zeta):
    model = beam(tmp_path, more, c)
    assert model.size > room.WHOLE  # or nothing would be truncated
    modes = model_modes(model, 6).flexible()
    f = np.linspace(0.3 * modes.frequencies[0], 1.1 * modes.frequencies[3], 83)
    where = np.array([model.place[q] for q in ("n7.z", "n60.z", "n101.z", "n40.ry")])
    H, exact = model_frf(model, f, where, where[:3]), dense(model, f, where, where[:3], zeta)
    assert np.linalg.norm(H - exact) < 2e-4 * np.linalg.norm(exact)
    antiresonance = np.abs(exact) < 0.02 * np.abs(exact).max(axis=0)
    assert (
        np.median(np.abs(H - exact)[antiresonance] / np.abs(exact)[antiresonance]) < 1e-3
    )  # the static corrections hold them in place
    assert np.allclose(
        H[:, :3], H[:, :3].transpose(0, 2, 1), rtol=1e-9, atol=1e-12 * np.abs(H).max()
    )  # reciprocity


def test_quantities_held_dofs_and_bad_words(tmp_path):
    model = beam(tmp_path, SUPPORT, c=1.0, elements=20)
    f = np.array([3.0, 11.0, 40.0])
    at = np.array([model.place["n5.z"], -1])
    x, v, a = (model_frf(model, f, at, at, q) for q in ("displacement", "velocity", "acceleration"))
    s = (2j * np.pi * f)[:, None, None]
    assert np.allclose(v, s * x) and np.allclose(a, s * v)
    assert np.all(x[:, 1] == 0.0) and np.all(x[:, :, 1] == 0.0) and np.all(x[:, 0, 0] != 0.0)
    assert np.allclose(x[:, :1, :1], dense(model, f, at[:1], at[:1]))
    with pytest.raises(InputError, match="no motion"):
        model_frf(model, f, at, at, "strain")
