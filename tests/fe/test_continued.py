"""Modes continued from those before are the modes."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.continued import continued_modes
from cvxupdate.fe.modes import model_modes
from tests.cases.structures import PORTAL, portal, square, structure


def test_modes_after_a_change_are_those_from_nothing() -> None:
    """Eigenvalues to rounding, shapes to the square root of it, from modes 30 % away."""
    model = structure(portal(), PORTAL)[1]
    before = model_modes(model, 10, model.zero())
    p = np.full(len(model.parameters), 0.3) * np.cos(np.arange(len(model.parameters)))
    m = model.matrices(p)
    found = continued_modes(m, before, 5)
    other = model_modes(model, 10, p, m)
    assert found is not None and found.exact == 5
    assert np.allclose(found.modes.eigenvalues[:5], other.eigenvalues[:5], rtol=1e-11)
    likeness = np.einsum("ij,ij->j", other.shapes[:, :5], m.M @ found.modes.shapes[:, :5])
    assert np.allclose(np.abs(likeness), 1.0, atol=1e-12)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-7, 1e-10])
def test_accuracy_that_is_asked_for_is_kept(accuracy: float) -> None:
    """Far off and near, the angle to the true mode is below what was asked for."""
    model = structure(portal(), PORTAL)[1]
    before = model_modes(model, 8, model.zero())
    for size in (0.3, 1e-2, 1e-5):
        p = size * np.cos(np.arange(len(model.parameters)))
        m = model.matrices(p)
        found = continued_modes(m, before, 5, accuracy)
        other = model_modes(model, 8, p, m)
        assert found is not None
        like = other.shapes.T @ (m.M @ found.modes.shapes[:, :5])
        apart = found.modes.shapes[:, :5] - other.shapes[:, :5] * np.sign(np.diag(like))
        assert np.sqrt(np.einsum("ij,ij->j", apart, m.M @ apart)).max() <= accuracy


def test_free_structures_are_left_to_the_solver_that_knows_rigid_modes() -> None:
    model = structure(square(), [{"elements": "all", "of": "E"}])[1]
    before = model_modes(model, 8, model.zero())
    assert before.rigid > 0
    assert continued_modes(model.matrices(), before, 5) is None


def test_stiffness_that_went_below_zero_is_said() -> None:
    model = structure(portal(), PORTAL)[1]
    before = model_modes(model, 10, model.zero())
    with pytest.raises(ModelError, match="not positive definite"):
        continued_modes(model.matrices(np.full(len(model.parameters), -1.5)), before, 5)
