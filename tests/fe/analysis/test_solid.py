"""Sheets on finer parts as solids: torsion and inertia of a rectangular block in closed form, mass
and rigid motions kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem

A, B, H = 0.3, 0.2, 0.006
STEEL = "E = 207e9\nnu = 0.3\nrho = 7850.0\n"


def read(folder, text):
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


CLAMPED = """[[model.supports]]
nodes = [1, 6, 11, 16]
dofs = ["z", "rx", "ry"]
"""


def sheet(nx: int, ny: int, supports: str = "", a: float = A, h: float = H) -> str:
    nodes = ", ".join(
        f"{{ id = {1 + i + j * (nx + 1)}, x = {a * i / nx:.9g}, y = {B * j / ny:.9g} }}"
        for j in range(ny + 1)
        for i in range(nx + 1)
    )
    corners = [1 + i + j * (nx + 1) for j in range(ny) for i in range(nx)]
    rows = ", ".join(
        f"{{ id = {k + 1}, nodes = [{c}, {c + 1}, {c + nx + 2}, {c + nx + 1}] }}"
        for k, c in enumerate(corners)
    )
    return (
        f'title = "Sheet"\n[model]\ndofs = ["z", "rx", "ry"]\nnodes = [{nodes}]\n'
        f"[model.materials.steel]\n{STEEL}"
        f'[model.sections.skin]\nshape = "plate"\nthickness = {h}\n'
        '[[model.elements]]\ntype = "plate"\nmaterial = "steel"\nsection = "skin"\n'
        f"rows = [{rows}]\n"
        f"{supports}"
    )


def test_mass_and_rigid_motions_are_those_of_the_sheet(tmp_path):
    spec, file = read(tmp_path, sheet(4, 3))
    thin, thick = (analysis_of(spec, file, 4, solid=s).on(file) for s in (False, True))
    one = np.array([1.0 if x.endswith(".z") else 0.0 for x in thin.labels])
    M = [m.matrices(m.zero()).M for m in (thin, thick)]
    assert one @ M[1] @ one == pytest.approx(A * B * H * 7850.0, rel=1e-9)
    assert one @ M[0] @ one == pytest.approx(A * B * H * 7850.0, rel=1e-9)
    assert model_modes(thick, 6).rigid == 3
    y = np.array([float(thick.xyz[n, 1]) for n in thick.dof_node])
    roll = np.where(one > 0.0, y, 0.0) + np.array([x.endswith(".rx") for x in thick.labels])
    strained = np.abs(thick.matrices(thick.zero()).K @ roll).max()
    assert strained < 1e-6 * np.abs(thick.matrices(thick.zero()).K).max()


def test_it_turns_like_a_block(tmp_path):
    """About an axis through its centre: m (b² + h²) / 12."""
    spec, file = read(tmp_path, sheet(4, 3))
    model = analysis_of(spec, file, 4, solid=True).on(file)
    y = model.xyz[model.dof_node, 1] - B / 2.0
    kind = np.array([label.split(".")[-1] for label in model.labels])
    inner = model.dof_kind > 5
    roll = np.where(inner, 0.0, np.where(kind == "z", y, 0.0) + (kind == "rx"))
    inertia = roll @ model.matrices(model.zero()).M @ roll
    assert inertia == pytest.approx(7850.0 * A * B * H * (B**2 + H**2) / 12.0, rel=1e-9)


@pytest.mark.parametrize("h", [H, 0.024, 0.035])
def test_a_rim_counts_as_its_torsion_only(tmp_path, h):
    """A strip twisted evenly: G (b h³ / 3 − 0.21 h⁴) a metre and radian, Saint-Venant's; of
    elements that are longer than three thicknesses, some of them, and none."""
    spec, file = read(tmp_path, sheet(4, 3, h=h))
    model = analysis_of(spec, file, 4, solid=True).on(file)
    x, y = (model.xyz[model.dof_node, k] - (A / 2.0, B / 2.0)[k] for k in (0, 1))
    kind = np.array([label.split(".")[-1] for label in model.labels])
    inner = model.dof_kind > 5
    twist = np.where(kind == "z", x * y, 0.0) + np.where(kind == "rx", x, 0.0)
    twist = np.where(inner, 0.0, twist + np.where(kind == "ry", -y, 0.0))
    energy = twist @ model.matrices(model.zero()).K @ twist
    G = 207e9 / 2.6
    along = G * (A * B * h**3 / 3.0 - 0.63 / 3.0 * h**4 * (A + B))
    assert energy == pytest.approx(along, rel=1e-6)


@pytest.mark.parametrize("h", [0.015, 0.024, 0.035])
@pytest.mark.parametrize("parts", [4, 8])
def test_however_thick_and_finely_divided_nothing_pushes(tmp_path, h, parts):
    """The rim of elements of two thicknesses, in eight parts, was unstable: a null plate had no
    analysis model, and what its supports gave in shear was taken for a finding."""
    spec, file = read(tmp_path, sheet(4, 3, h=h))
    model = analysis_of(spec, file, parts, solid=True).on(file)
    K = model.matrices(model.zero()).K.toarray()
    stiff = np.linalg.eigvalsh(K)
    assert stiff[0] > -1e-9 * stiff[-1] and np.sum(stiff < 1e-9 * stiff[-1]) == 3


@pytest.mark.parametrize("turned", [False, True])
def test_a_clamp_that_reaches_in_makes_a_sheet_shorter(tmp_path, turned):
    """By a fiftieth of its thickness, to first order; whichever way its elements run."""
    made = sheet(4, 3, CLAMPED)
    if turned:
        for c in (1 + k % 4 + 5 * (k // 4) for k in range(12)):
            around = (c, c + 1, c + 6, c + 5)
            made = made.replace(
                "[{}, {}, {}, {}]".format(*around), "[{1}, {2}, {3}, {0}]".format(*around)
            )
    spec, file = read(tmp_path, made)
    own = analysis_of(spec, file, 4, solid=True).on(file)
    reach = 0.02
    held = replace(own, blocks=tuple(_with(b, reach) for b in own.blocks))
    spec, file = read(tmp_path, sheet(4, 3, CLAMPED, A - reach * H))
    shorter = analysis_of(spec, file, 4, solid=True).on(file)
    f, g, true = (model_modes(m, 5).frequencies for m in (own, held, shorter))
    assert np.all(true > 1.0001 * f)
    np.testing.assert_allclose(g / f - 1.0, true / f - 1.0, rtol=0.06)


def _with(block, reach):
    return replace(block, properties={**block.properties, "clamp": np.full(len(block.ids), reach)})
