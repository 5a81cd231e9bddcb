"""Derivatives of eigenvalues (2.100) and mode shapes against the whole model."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.residual.eigen import (
    derivatives_of,
    eigenvalue_derivatives,
    forms,
    shape_derivatives,
    splitting,
)
from tests.cases.elements import grid
from tests.cases.structures import PORTAL, free_chain, portal, square, structure

Real = NDArray[np.float64]

PLATE = (
    {"group": "odd", "of": "Dx"},
    {"group": "odd", "of": "D1"},
    {"group": "even", "of": "thickness"},
    {"elements": "all", "of": "nu"},
    {"elements": "all", "of": "rho"},
    {"elements": [1, 4], "of": "E", "name": "pair"},
)
CHAIN = (
    {"group": "k1", "of": "k"},
    {"group": "m3", "of": "m"},
    {"group": "support", "of": "k", "scale": 1e5},
)


def portal_model() -> Model:
    return structure(portal(), PORTAL)[1]


def plate_model() -> Model:
    return structure(grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26]), PLATE)[1]


def chain_model() -> Model:
    return structure(free_chain(), CHAIN)[1]


MODELS = pytest.mark.parametrize("build", [portal_model, plate_model, chain_model])


def somewhere(model: Model) -> Real:
    return np.random.default_rng(3).uniform(0.05, 0.2, len(model.parameters))


@MODELS
def test_forms_equal_those_of_the_whole_matrices_by_complex_step(build) -> None:
    model = build()
    p = somewhere(model)
    rng = np.random.default_rng(0)
    left, right = rng.standard_normal((model.size, 3)), rng.standard_normal((model.size, 3))
    mine = dict(zip("KM", forms(left, right, derivatives_of(model, p)), strict=True))
    for j in range(len(p)):
        step = np.zeros(len(p), dtype=complex)
        step[j] = 1e-30j
        m = model.matrices(p + step)
        for name in "KM":
            exact = np.einsum("nc,nc->c", left, getattr(m, name).imag @ right) / 1e-30
            assert np.allclose(
                mine[name][:, j], exact, rtol=1e-11, atol=1e-12 * np.abs(mine[name]).max()
            )


@MODELS
def test_eigenvalues_of_the_whole_model_by_complex_step(build) -> None:
    """λ(p + ih) of the complex pencil: no subtraction, so it agrees to rounding."""
    model = build()
    p = somewhere(model)
    modes = model_modes(model, 6, p)
    keep = slice(modes.rigid, None)
    mine = eigenvalue_derivatives(
        modes.eigenvalues[keep], modes.shapes[:, keep], derivatives_of(model, p)
    )
    for j in range(len(p)):
        step = np.zeros(len(p), dtype=complex)
        step[j] = 1e-12j
        m = model.matrices(p + step)
        values = la.eigvals(m.K.toarray(), m.M.toarray())
        for k, value in enumerate(modes.eigenvalues[keep]):
            near = values[np.argmin(np.abs(values - value))]
            assert abs(mine[k, j] - near.imag / 1e-12) <= 2e-6 * np.abs(mine[k]).max()


def central(model: Model, p: Real, j: int, at: int, sensors: Real, h: float) -> Real:
    def shape(q: Real) -> Real:
        modes = model_modes(model, 6, q)
        s = modes.shapes[:, at]
        reference = model_modes(model, 6, p).shapes[:, at]
        return s[sensors] * np.sign(s @ (model.matrices(p).M @ reference))

    d = np.zeros(len(p))
    d[j] = h
    return (8 * (shape(p + d) - shape(p - d)) - (shape(p + 2 * d) - shape(p - 2 * d))) / (12 * h)


@MODELS
def test_shapes_against_central_differences_of_the_whole_model(build) -> None:
    model = build()
    p = somewhere(model)
    m, modes = model.matrices(p), model_modes(model, 6, p)
    sensors = np.unique(np.linspace(0, model.size - 1, 5).astype(int))
    derivatives = derivatives_of(model, p)
    moved = 0.0
    for at in range(modes.rigid, modes.rigid + 3):
        mine = shape_derivatives(
            m, float(modes.eigenvalues[at]), modes.shapes[:, at], sensors, derivatives
        )
        for j in range(len(p)):
            other = central(model, p, j, at, sensors, 3e-4)
            assert np.abs(mine[:, j] - other).max() <= 1e-5 * max(
                np.abs(mine).max(), np.abs(modes.shapes[sensors, at]).max()
            ), (at, j)
            moved = max(moved, np.abs(other).max())
    assert moved > 0.1  # the test sees something


def test_eigenvalue_of_a_support_spring_that_grows_from_zero() -> None:
    """A free chain's rigid mode: λ = 0 and ∂λ/∂k = φ_s², exact while the spring is absent; the
    flexible modes follow (2.100) as ever."""
    model = chain_model()
    modes = model_modes(model, 4, model.zero())
    assert modes.rigid == 1 and modes.eigenvalues[0] == 0.0
    d = eigenvalue_derivatives(modes.eigenvalues, modes.shapes, derivatives_of(model, model.zero()))
    h = 1e-3
    grown = model_modes(model, 5, np.array([0.0, 0.0, h]))
    assert grown.rigid == 0
    assert np.allclose(d[:, 2], (grown.eigenvalues - modes.eigenvalues) / h, rtol=5e-3)
    assert np.allclose(d[0, :2], 0.0, atol=1e-6 * d[0, 2])


def pair_of(model: Model) -> tuple[Modes, np.ndarray]:
    modes = model_modes(model, 8, model.zero())
    at = np.array([modes.rigid + 3, modes.rigid + 4])
    assert abs(np.diff(modes.eigenvalues[at])[0]) < 1e-8 * modes.eigenvalues[at[0]]
    return modes, at


def test_repeated_eigenvalue_splits_along_the_basis_of_splitting() -> None:
    """A square plate: Dx and Dy split a pair in opposite ways; in the turned basis (2.100) is the
    derivative of the sorted pair."""
    model = structure(
        square(),
        [
            {"elements": "all", "of": "Dx"},
            {"elements": "all", "of": "Dy"},
            {"elements": [6], "of": "rho"},
        ],
    )[1]
    modes, at = pair_of(model)
    derivatives = derivatives_of(model, model.zero())
    rng = np.random.default_rng(1)
    any_basis = modes.shapes[:, at] @ la.qr(rng.standard_normal((2, 2)))[0]
    value = float(modes.eigenvalues[at].mean())
    Q = splitting(value, any_basis, derivatives)
    assert np.allclose(Q.T @ Q, np.eye(2), atol=1e-14)
    mine = eigenvalue_derivatives(modes.eigenvalues[at], any_basis @ Q, derivatives)
    mean = eigenvalue_derivatives(modes.eigenvalues[at], any_basis, derivatives).sum(axis=0)
    assert np.allclose(
        mine.sum(axis=0), mean, rtol=1e-10
    )  # the sum of a pair has a derivative in any basis
    h = 1e-4
    for j in (0, 1):
        p = np.zeros(3)
        p[j] = h
        split = (model_modes(model, 8, p).eigenvalues[at] - value) / h
        assert np.allclose(np.sort(mine[:, j]), np.sort(split), rtol=2e-3)


def test_a_basis_that_nothing_splits_stays() -> None:
    model = structure(square(), [{"elements": "all", "of": "E"}])[1]
    modes, at = pair_of(model)
    assert np.array_equal(
        splitting(
            float(modes.eigenvalues[at[0]]),
            modes.shapes[:, at],
            derivatives_of(model, model.zero()),
        ),
        np.eye(2),
    )


def test_shape_of_a_repeated_eigenvalue_needs_its_partners() -> None:
    """With the partners given, E scales a pair of a square plate and leaves its shapes, while rho
    shrinks them by half (φᵀMφ = 1)."""
    model = structure(square(), [{"elements": "all", "of": "E"}, {"elements": "all", "of": "rho"}])[
        1
    ]
    modes, at = pair_of(model)
    m, derivatives = model.matrices(), derivatives_of(model, model.zero())
    sensors = np.array([0, 7, 22])
    phi = modes.shapes[:, at[0]]
    d = shape_derivatives(
        m, float(modes.eigenvalues[at[0]]), phi, sensors, derivatives, modes.shapes[:, at[1:]]
    )
    assert np.allclose(d[:, 0], 0.0, atol=1e-7 * np.abs(phi).max())
    assert np.allclose(d[:, 1], -0.5 * phi[sensors], atol=1e-6 * np.abs(phi).max())


def test_nearly_repeated_shapes_turn_fast_but_right() -> None:
    """A plate 0.1 % off square: the derivative grows like one over the gap and still agrees with
    differences."""
    model = structure(
        square(1.001), [{"elements": "all", "of": "Dx"}, {"elements": [2, 7], "of": "rho"}]
    )[1]
    p = model.zero()
    m, modes = model.matrices(p), model_modes(model, 6, p)
    at = modes.rigid + 3
    gap = (modes.eigenvalues[at + 1] - modes.eigenvalues[at]) / modes.eigenvalues[at]
    assert 1e-4 < gap < 1e-2
    sensors = np.array([0, 7, 22])
    mine = shape_derivatives(
        m, float(modes.eigenvalues[at]), modes.shapes[:, at], sensors, derivatives_of(model, p)
    )
    for j in range(2):
        assert np.allclose(
            mine[:, j],
            central(model, p, j, at, sensors, 1e-5),
            rtol=1e-3,
            atol=1e-4 * np.abs(mine).max(),
        )
