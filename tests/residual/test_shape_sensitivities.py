"""Every way to differentiate a shape, against complex step through the whole eigenvalue problem, on
a model with stiffness, mass and damping parameters."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.continued import Continued, continued_modes
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.residual.derivatives import derivatives_of, forms, pushes, stacked
from cvxupdate.residual.eigen import (
    adjoint_shapes,
    functional_derivatives,
    second_derivatives,
    shape_derivatives,
    shape_motion,
)
from cvxupdate.residual.nelson import SharedSolver
from tests.cases.structures import PORTAL, free_chain, portal, structure

P = np.array([0.05, -0.03, 0.02, 0.04, 0.1, -0.05, 0.02])
SENSORS = np.array([0, 4, 7, 11])
STEP = 1e-25


def at_p() -> tuple[Model, Modes, Continued]:
    model = structure(portal(), PORTAL)[1]
    m = model.matrices(P)
    found = continued_modes(m, model_modes(model, 10, P, m), 6)
    assert found is not None
    return model, found.modes, found


def complex_mode(model: Model, p: np.ndarray, value: float, shape: np.ndarray) -> np.ndarray:
    """(λ, φ) at a complex p by Newton's method on (K − λM) φ = 0, φᵀMφ = 1 from a mode of the real
    part: exact, for the iteration is quadratic and no difference is taken."""
    m = model.matrices(p)
    K, M = m.K.toarray(), m.M.toarray()
    lam, phi = complex(value), shape.astype(complex)
    for _ in range(6):
        Mphi = M @ phi
        J = np.block([[K - lam * M, -Mphi[:, None]], [2 * Mphi[None, :], np.zeros((1, 1))]])
        r = np.concatenate([(K - lam * M) @ phi, [phi @ Mphi - 1.0]])
        step = np.linalg.solve(J, r)
        phi, lam = phi - step[:-1], lam - step[-1]
    return np.concatenate([[lam], phi])


def complex_step(model: Model, modes: Modes, at: int) -> np.ndarray:
    """∂(λ, φ)/∂p, (1 + N, parameters)."""
    out = []
    for j in range(len(P)):
        p = P.astype(complex)
        p[j] += 1j * STEP
        mode = complex_mode(model, p, modes.eigenvalues[at], modes.shapes[:, at])
        out.append(mode.imag / STEP)
    return np.array(out).T


@pytest.mark.parametrize("at", [0, 2, 4])
def test_every_form_agrees_with_complex_step(at: int) -> None:
    model, modes, found = at_p()
    m, d = model.matrices(P), derivatives_of(model, P)
    lam, phi = float(modes.eigenvalues[at]), modes.shapes[:, at]
    exact = complex_step(model, modes, at)[1:]
    size = np.abs(exact).max()
    assert size > 1e-3 and np.abs(exact[:, -1]).max() == 0.0  # a dashpot moves no undamped mode
    entries = shape_derivatives(m, lam, phi, SENSORS, d)
    assert np.allclose(entries, exact[SENSORS], atol=1e-8 * size)
    forward = shape_motion(modes, at, lambda f: adjoint_shapes(m, lam, phi, f), m, d)
    assert np.allclose(forward, exact, atol=1e-8 * size)
    g = np.random.default_rng(at).standard_normal((model.size, 2))
    solver = SharedSolver(found.mass, found.factor, modes.eigenvalues[:6], modes.shapes[:, :6])
    same = np.zeros((6, 2), dtype=bool)
    same[at] = True
    y = solver.solve(np.full(2, lam), g, same)
    assert np.allclose(y, adjoint_shapes(m, lam, phi, g), atol=1e-8 * np.abs(y).max())
    shared = functional_derivatives(lam, phi, g, y, d)
    assert np.allclose(shared, g.T @ exact, atol=1e-8 * np.abs(g.T @ exact).max())


def linear_chain() -> Model:
    return structure(
        free_chain(),
        [
            {"group": "k1", "of": "k"},
            {"group": "m3", "of": "m"},
            {"group": "support", "of": "k", "scale": 1e5},
        ],
    )[1]


def test_second_derivatives_of_eigenvalues_against_complex_step_of_the_first() -> None:
    model, p = linear_chain(), np.array([0.1, -0.2, 0.5])
    m, modes = model.matrices(p), model_modes(model, 4, p)
    d = derivatives_of(model, p)
    for at in range(3):
        lam, phi = float(modes.eigenvalues[at]), modes.shapes[:, at]
        moved = shape_motion(
            modes, at, lambda f, lam=lam, phi=phi: adjoint_shapes(m, lam, phi, f), m, d
        )
        mine = second_derivatives(modes, at, moved, d)
        assert np.allclose(mine, mine.T)
        for j in range(3):
            q = p.astype(complex)
            q[j] += 1j * STEP
            mode = complex_mode(model, q, lam, phi)
            dK, dM = pushes(phi, d)
            dphi = mode[1:].imag / STEP
            dlam = mode[0].imag / STEP
            other = 2 * dphi @ (dK - lam * dM) - dlam * (phi @ dM)
            assert np.allclose(mine[j], other, atol=1e-8 * np.abs(mine).max())
    h = 1e-4  # and against differences of the eigenvalues themselves
    values = [model_modes(model, 4, p + t * h * np.eye(3)[0]).eigenvalues[1] for t in (-1, 0, 1)]
    lam, phi = float(modes.eigenvalues[1]), modes.shapes[:, 1]
    moved = shape_motion(modes, 1, lambda f: adjoint_shapes(m, lam, phi, f), m, d)
    other = (values[0] - 2 * values[1] + values[2]) / h**2
    assert second_derivatives(modes, 1, moved, d)[0, 0] == pytest.approx(other, rel=1e-4)


def test_stacked_derivatives_are_the_same() -> None:
    model = structure(portal(), PORTAL)[1]
    d = derivatives_of(model, P)
    s = stacked(d, model.size)
    rng = np.random.default_rng(0)
    left, right = rng.standard_normal((2, model.size, 3))
    for a, b in zip(forms(left, right, d), forms(left, right, s), strict=True):
        assert np.allclose(a, b, atol=1e-12 * np.abs(a).max())
    for a, b in zip(pushes(left[:, 0], d), pushes(left[:, 0], s), strict=True):
        assert np.allclose(a, b, atol=1e-12 * np.abs(a).max())
