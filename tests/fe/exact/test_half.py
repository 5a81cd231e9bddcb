"""tanh(√z)/√z and what is symmetric in two of them: identities, both sides of the series, complex
step."""

import numpy as np
import pytest

from cvxupdate.fe.exact.half import SERIES, SMALL, pair, tau, tau_slope

SCALES = (1e-9, 1e-4, 0.02, 0.29, 0.31, 2.0, 40.0)


def roots(scale: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    return scale * rng.uniform(0.5, 1.0, 8) * rng.choice([-1, 1], 8), scale * rng.uniform(-1, 1, 8)


def test_series_of_the_hyperbolic_tangent() -> None:
    assert np.allclose(SERIES[:4], [1.0, -1 / 3, 2 / 15, -17 / 315], rtol=1e-15)


def test_both_sides_of_the_switch_agree() -> None:
    """The series just below it and the function just above continue each other."""
    for sign in (1.0, -1.0, 1j):
        z = sign * SMALL * (1.0 + np.array([-1e-9, 1e-9]))
        value, slope = tau(z), tau_slope(z, tau(z))
        step = z[1] - z[0]
        assert np.abs(value[1] - value[0] - slope[0] * step) < 1e-15
        assert np.isclose(slope[0], slope[1], rtol=1e-8)


def test_tangent_where_the_argument_is_negative() -> None:
    x = np.array([0.1, 1.0, 1.5, 2.0, 7.0])
    assert np.allclose(tau(-(x**2)), np.tan(x) / x, rtol=1e-13)
    assert np.allclose(tau(x**2), np.tanh(x) / x, rtol=1e-14)


@pytest.mark.parametrize("scale", SCALES)
def test_pairs(scale: float) -> None:
    z1, z2 = roots(scale)
    p = pair(z1 + z2, z1 * z2)
    t1, t2 = tau(z1), tau(z2)
    assert np.allclose(p.product, t1 * t2, rtol=1e-13)
    assert np.allclose(p.moment, t1 + z2 * p.difference, rtol=1e-13)
    far = np.abs(z1 - z2) > 0.2 * scale
    if scale > 0.01:
        assert np.allclose(p.difference[far], ((t1 - t2) / (z1 - z2))[far], rtol=1e-11)


@pytest.mark.parametrize("scale", SCALES)
def test_derivatives_by_complex_step(scale: float) -> None:
    z1, z2 = roots(scale)
    e1, e2 = z1 + z2, z1 * z2
    values = pair(e1, e2)
    for direction in (0, 1):
        d1, d2 = (1e-30j, 0.0) if direction == 0 else (0.0, 1e-30j)
        stepped = pair(e1 + d1, e2 + d2)
        for k, name in enumerate(("difference", "moment", "product")):
            exact = getattr(stepped, name).imag / 1e-30
            size = np.abs(exact).max()
            assert np.abs(values.slopes[k][direction] - exact).max() < 1e-10 * size


def test_equal_roots() -> None:
    """No division where both roots are one: at rest, where both are zero."""
    p = pair(np.zeros(1), np.zeros(1))
    assert np.allclose([p.difference, p.moment, p.product], [[-1 / 3], [1.0], [1.0]])
