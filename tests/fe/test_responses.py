"""Receptances and condensation against dense inversion, modal sums, reciprocity and the structure's
own physics."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.damping import (
    loss_factor_from_modal,
    modal_matrix,
    rayleigh_from_modal,
    with_modal_damping,
)
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import (
    condense,
    damped,
    dynamic_stiffness,
    held_frequencies,
    matrices_with_damping,
)
from cvxupdate.fe.synthesis import receptance
from validation import make_bay as bay

DAMPED = '[model.damping]\nkind = "structural"\neta = 0.02'
RAYLEIGH = '[model.damping]\nkind = "rayleigh"\nalpha = 3.0\nbeta = 1e-5'
MODAL = '[model.damping]\nkind = "modal"\nzeta = [0.01, 0.02, 0.015]'
SEVEN = ("n1.x", "n1.z", "n5.z", "n9.ry", "n13.y", "n17.z", "n19.z")


@pytest.fixture(
    scope="module", params=["", DAMPED, RAYLEIGH], ids=["undamped", "structural", "rayleigh"]
)
def model(request):
    return bay.build("FE1", request.param)


def places(model, labels):
    return np.array([model.place[q] for q in labels])


def test_receptance_is_the_inverse_and_reciprocal(model):
    f = np.array([17.0, 111.0, 260.0])
    at = places(model, SEVEN)
    H = receptance(model, f, at, at)
    assert np.iscomplexobj(H) == damped(model.matrices())
    assert pytest.approx(bay.receptance(model, f, SEVEN, SEVEN), rel=1e-7, abs=1e-16) == H
    assert pytest.approx(H.transpose(0, 2, 1), rel=1e-7, abs=1e-16) == H
    if damped(
        model.matrices()
    ):  # a passive structure takes power in: Im H of a drive point is negative
        assert np.all(np.diagonal(H, axis1=1, axis2=2).imag < 0)


@pytest.mark.parametrize("reference", ["n5.z", "n18.z", "n3.rx"])
def test_condensation_is_exact(model, reference):
    """Z_red is the inverse of H_nn (3.14), T carries it to every DOF, and a force at an unmeasured
    DOF is carried as well."""
    at, by = places(model, SEVEN), places(model, [reference, "n1.x"])
    f = 87.0
    c = condense(matrices_with_damping(model), f, at, by)
    Z = dynamic_stiffness(model.matrices(), 2 * np.pi * f).toarray()
    H = np.linalg.inv(Z)
    assert np.linalg.inv(c.Z) == pytest.approx(H[np.ix_(at, at)], rel=1e-6, abs=1e-16)
    motion = np.linalg.solve(c.Z, c.force)
    assert motion == pytest.approx(H[np.ix_(at, by)], rel=1e-6, abs=1e-14)
    assert c.field(motion) == pytest.approx(H[:, by], rel=1e-6, abs=1e-13)
    assert pytest.approx(c.Z, rel=1e-7, abs=1e-4 * np.abs(c.Z).max() * 1e-4) == c.T.T @ Z @ c.T


def test_all_measured_in_any_order():
    model = bay.build("X1")
    order = np.random.default_rng(0).permutation(model.size)
    c = condense(model.matrices(), 50.0, order, order[:1])
    Z = dynamic_stiffness(model.matrices(), 100 * np.pi).toarray()
    assert pytest.approx(Z[np.ix_(order, order)], abs=1e-9 * np.abs(Z).max()) == c.Z
    x = np.arange(model.size, dtype=float)[:, None]
    assert c.field(x)[order, 0] == pytest.approx(x[:, 0])


def test_modal_sum_of_a_modally_damped_model():
    """H = Σ φφᵀ/(ω_r² − ω² + 2iζ_r ω_r ω) and the rigid-body part, the last ζ for the rest."""
    model = bay.build("X1", MODAL)
    modes = model_modes(model, model.size)
    zeta = np.concatenate(
        [
            np.zeros(modes.rigid),
            [0.01, 0.02],
            np.full(len(modes.eigenvalues) - modes.rigid - 2, 0.015),
        ]
    )
    at = places(model, SEVEN)
    phi = modes.shapes[at]
    for f in (30.0, 102.2, 260.0):
        w = 2 * np.pi * f
        expected = (
            phi
            / (modes.eigenvalues - w**2 + 2j * zeta * np.sqrt(np.maximum(modes.eigenvalues, 0)) * w)
        ) @ phi.T
        assert receptance(model, [f], at, at)[0] == pytest.approx(
            expected, rel=1e-5, abs=1e-9 * np.abs(expected).max()
        )


def test_modal_matrix_has_the_modes_of_the_structure():
    model = bay.build("X1")
    modes = model_modes(model, 12).flexible()
    m = model.matrices()
    zeta = np.linspace(0.01, 0.03, 12)
    C = modal_matrix(modes.eigenvalues, modes.shapes, m.M, zeta)
    assert np.diag(modes.shapes.T @ C @ modes.shapes) == pytest.approx(
        2 * zeta * np.sqrt(modes.eigenvalues), rel=1e-8
    )
    assert np.linalg.eigvalsh(C).min() > -1e-8 * np.abs(C).max()
    with pytest.raises(ModelError, match="Rayleigh"):
        from cvxupdate.fe import damping

        limit, damping.LARGEST = damping.LARGEST, 10
        try:
            with_modal_damping(bay.build("X1", MODAL), m)
        finally:
            damping.LARGEST = limit


def test_rayleigh_from_modal_damping():
    f = np.array([20.0, 55.0, 130.0])
    w = 2 * np.pi * f
    assert rayleigh_from_modal(f, 4.0 / (2 * w) + 2e-5 * w / 2) == pytest.approx(
        (4.0, 2e-5), rel=1e-9
    )
    # falling ζ: pure mass damping; rising faster than ω: pure stiffness damping. Neither constant
    # goes negative.
    alpha, beta = rayleigh_from_modal(f, [0.05, 0.012, 0.001])
    assert alpha > 0 and beta == 0.0
    alpha, beta = rayleigh_from_modal(f, [0.001, 0.01, 0.06])
    assert alpha == 0.0 and beta > 0
    assert loss_factor_from_modal([0.01, 0.03]) == pytest.approx(0.04)
    with pytest.raises(InputError, match="above 0"):
        rayleigh_from_modal([0.0], [0.01])


def test_singular_frequencies_are_named():
    model = bay.build("X1")
    at = places(model, SEVEN)
    with pytest.raises(ModelError, match=r"at 0 Hz is singular: .* natural frequency"):
        receptance(model, [0.0], at, at[:1])


def test_held_frequencies_are_where_the_reduced_stiffness_has_poles():
    model = bay.build("X1", "")
    at = places(model, bay.TEN)
    held = held_frequencies(model, at, 4)
    m = model.matrices()
    for f in held[held > 1.0]:
        near, far = (np.abs(condense(m, f * s, at, at[:1]).Z).max() for s in (1 + 1e-7, 1.05))
        assert near > 1e2 * far
    assert len(held_frequencies(model, np.arange(model.size), 3)) == 0
