"""A structure on a moving base against the exact partition of its dynamic stiffness."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.build import build_model, on_its_bases
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import combined, matrices_with_damping
from cvxupdate.spec import read_text
from tests.cases.shaking_table import FLOORS, structure, transmissibilities

BASE = '[[model.bases]]\nnodes = [1, 5]\ndof = "x"\n'
LINES = np.linspace(1.0, 60.0, 240)


def test_its_motion_is_that_of_the_exact_partition() -> None:
    spec = on_its_bases(read_text(structure(0.8) + BASE, "frame.toml"))
    model, (base,) = build_model(spec), spec.model.bases
    m, row = matrices_with_damping(model), model.place["n5.x"]
    assert row == model.place["n1.x"], "both feet are one DOF"
    force = np.zeros(model.size)
    force[row] = base.mass
    s = 2j * np.pi * LINES
    own = [
        p
        * p
        * np.linalg.solve(combined(m, p, True).toarray(), force)[
            [model.place[f"n{n}.x"] for n in FLOORS]
        ]
        for p in s
    ]
    exact = transmissibilities(s, 0.8)
    assert np.max(np.abs(np.array(own) - exact)) < 1e-5 * np.max(np.abs(exact))


def test_its_modes_are_those_of_the_clamped_structure() -> None:
    held = build_model(read_text(structure(), "frame.toml"))
    moved = build_model(read_text(structure() + BASE, "frame.toml"))
    flexible = model_modes(moved, 6).flexible().frequencies[:5]
    assert flexible == pytest.approx(model_modes(held, 5).frequencies[:5], rel=1e-6)
    assert moved.total_mass() == pytest.approx(held.total_mass())


def test_a_base_needs_something_on_it_and_a_mass_to_go_by() -> None:
    held = '[[model.supports]]\nnodes = [99]\ndofs = ["x", "y", "rz"]\n'
    loose = structure().replace("nodes = [{ id = 1,", "nodes = [{ id = 99, x = 3.0 }, { id = 1,")
    loose = loose.replace("[model.damping]", held + "[model.damping]")
    with pytest.raises(ModelError, match="nothing moves along x at node 99"):
        build_model(read_text(loose + BASE.replace("[1, 5]", "[99]"), "frame.toml"))
    spring = (
        '[model]\ndofs = ["x"]\nnodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }]\n'
        '[[model.elements]]\ntype = "spring"\ndof = "x"\nk = 1.0\n'
        "rows = [{ id = 1, nodes = [1, 2] }]\n"
    )
    with pytest.raises(ModelError, match="Give `mass`"):
        build_model(read_text(spring + BASE.replace("[1, 5]", "[1]"), "spring.toml"))
