"""Supports that give way where a sheet does so itself: in series with it."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.points import on_points, points_of
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from tests.diagnose.nominal.test_points import CORNERS, THICK
from tests.fe.analysis.test_solid import read, sheet


@pytest.fixture
def context(tmp_path):
    _, file = read(tmp_path, sheet(4, 3, CORNERS, h=THICK))
    model = on_points(file, points_of(file))
    m = model.matrices(model.zero())

    def release(node, kind):
        raise AssertionError("nothing else is held")

    return SearchContext(model, m.K, m.M, 1e4, 1.0, (), (), release, 0.01), file


def effects_of(context):
    found = [e for e in candidates_of(context, ("grounding_spring",), "modes") if e.change.series]
    return [e for e in found if e.place.dof == "z"]


def test_each_support_and_all_alike(context):
    places = [e.place.nodes for e in effects_of(context[0])]
    assert sorted(places) == [(1,), (1, 5, 16, 20), (5,), (16,), (20,)]


def test_a_support_that_gives_way_is_a_spring_in_its_place(context, tmp_path):
    """Of k = 2 MN/m, beside the same file on such springs."""
    k = 2e6
    (all_alike,) = (e for e in effects_of(context[0]) if len(e.place.nodes) == 4)
    model = all_alike.change.model
    q, p = model.parameters[-1], model.zero()
    unit = q.targets[0].scales[0]
    p[-1] = np.ravel(1.0 / k / unit)[0]
    assert all_alike.figures[0].value(model, q, p[-1], 0.0)[0] == pytest.approx(k, rel=1e-2)
    rows = ", ".join(f"{{ id = {90 + n}, nodes = [{n}] }}" for n in (1, 5, 16, 20))
    springs = f'[[model.elements]]\ntype = "spring"\ndof = "z"\nk = {k}\nrows = [{rows}]\n'
    _, real = read(tmp_path, sheet(4, 3, springs, h=THICK))
    np.testing.assert_allclose(
        model_modes(model, 6, p).frequencies, model_modes(real, 6).frequencies, rtol=2e-3
    )


def test_its_tangent_is_that_of_the_model(context):
    K = context[0].K.toarray()
    modes = model_modes(context[0].model, 6)
    for e in effects_of(context[0]):
        model = e.change.model
        (exact,), (tangent,) = model.derivative(len(model.parameters) - 1), e.change.tangent[0]
        assert model.size == len(K)
        for phi in modes.shapes.T:
            a, b = (
                np.einsum("ei,eij,ej->", phi[d.dofs], d.K, phi[d.dofs]) for d in (exact, tangent)
            )
            assert b == pytest.approx(a, rel=1e-3, abs=1e-6 * abs(phi @ K @ phi))
