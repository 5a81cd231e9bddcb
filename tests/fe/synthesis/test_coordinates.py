"""A model in few coordinates: chosen DOFs come first, parameters do what they do, and it is a model
like any other."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis.coordinates import coordinates_of
from cvxupdate.fe.synthesis.space import space_of
from cvxupdate.physics.growth import append_parameters, limited
from tests.cases.cantilever import load
from tests.cases.long_bar import text

SPRING = (
    '[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{ id = 90, nodes = [31], k = 2e4 }]'
)


@pytest.fixture
def bar(tmp_path):
    """A cantilever of 120 DOFs on a spring: a stretch of it, the mass of another and the spring may
    change."""
    _, model = load(tmp_path, text(60, "rows = [{ frequency = 10.0 }]", SPRING))
    model = append_parameters(model, [limited("t", "stiffness", [*range(8, 20)], (-0.9, 9.0))])
    model = append_parameters(model, [limited("m", "mass", [*range(30, 41)], (-0.9, 9.0))])
    return append_parameters(model, [limited("k", "k", [90], (-0.9, 1e4), 2e4)])


@pytest.fixture
def few(bar):
    chosen = np.array([bar.place[f"n{n}.z"] for n in (20, 41, 61)])
    space = space_of(bar, bar.zero(), 300.0, chosen, (0, 1, 2))
    return chosen, coordinates_of(space, chosen)


@pytest.mark.parametrize("p", [[0.0, 0.0, 0.0], [0.3, 0.2, 40.0], [-0.3, 0.5, 2000.0]])
def test_its_modes_are_the_model_s(bar, few, p):
    chosen, made = few
    assert made.model.size < bar.size and made.model.labels[:3] == ("n20.z", "n41.z", "n61.z")
    true, own = (model_modes(m, 3, np.array(p)) for m in (bar, made.model))
    np.testing.assert_allclose(own.eigenvalues[:3], true.eigenvalues[:3], rtol=2e-4)
    for r in range(3):
        shape = made.lift @ own.shapes[:, r]
        np.testing.assert_allclose(shape[chosen], own.shapes[:3, r], atol=1e-9)
        assert abs(shape @ (bar.matrices(p).M @ true.shapes[:, r])) == pytest.approx(1.0, abs=1e-3)


def test_shapes_go_there_and_come_back(bar, few):
    _, made = few
    shapes = model_modes(bar, 3).shapes[:, :3]
    back = made.lift @ made.lowered(shapes, bar.matrices().M)
    np.testing.assert_allclose(back, shapes, atol=1e-7 * np.abs(shapes).max())


def test_dofs_that_the_shapes_cannot_move_apart_have_no_coordinates(bar):
    """More of them than there are shapes."""
    space = space_of(bar, bar.zero(), 30.0, np.zeros(0, dtype=np.int64), ())
    every = np.flatnonzero(bar.dof_kind < 3)
    assert space.V.shape[1] < len(every) and coordinates_of(space, every) is None
    twice = np.array([every[3], every[3]])
    assert coordinates_of(space, twice) is None
