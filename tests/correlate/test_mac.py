"""MAC, MSF, COMAC: identities that hold for every vector."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.correlate import comac, mac, mac_error, modal_scale_factor, paired_mac
from cvxupdate.errors import InputError


def shapes(seed: int, dofs: int = 9, modes: int = 4, complex_: bool = True) -> np.ndarray:
    rng = np.random.default_rng(seed)
    real = rng.standard_normal((dofs, modes))
    return real + 1j * rng.standard_normal((dofs, modes)) if complex_ else real


@given(st.integers(0, 10_000), st.floats(1e-6, 1e6), st.floats(-np.pi, np.pi))
@settings(max_examples=60, deadline=None)
def test_mac_is_one_for_a_scaled_rotated_copy_and_bounded(
    seed: int, scale: float, phase: float
) -> None:
    phi = shapes(seed)
    factor = scale * np.exp(1j * phase)
    macs = mac(phi, phi * factor)
    assert np.allclose(np.diag(macs), 1.0, atol=1e-12)
    assert np.all((macs >= 0.0) & (macs <= 1.0))
    assert np.allclose(mac(phi, phi), mac(phi, phi * factor), atol=1e-12)
    assert np.allclose(mac(phi, shapes(seed + 1)), mac(shapes(seed + 1), phi).T)
    s = modal_scale_factor(phi, phi * factor)
    assert np.allclose(s, factor, rtol=1e-12)


def test_a_plain_square_would_fail_here() -> None:
    circle = np.array(
        [1.0, 1.0j]
    )  # φᵀφ = 0: the unconjugated product of the vector with itself vanishes
    assert mac(circle, circle)[0, 0] == pytest.approx(1.0)
    assert mac(circle, circle.conj())[0, 0] == pytest.approx(0.0)


def test_msf_is_the_least_squares_factor() -> None:
    a, x = shapes(1), shapes(2)
    s = modal_scale_factor(a, x)
    for r in range(4):
        best = np.linalg.lstsq(a[:, [r]], x[:, r], rcond=None)[0][0]
        assert s[r] == pytest.approx(best)


def test_unmeasured_channels_are_left_out_pairwise() -> None:
    a, x = shapes(3), shapes(4)
    x[2, 1] = np.nan
    x[5, 3] = np.nan
    a[0, 0] = np.nan
    macs = mac(a, x)
    for i in range(4):
        for j in range(4):
            both = ~(np.isnan(a[:, i]) | np.isnan(x[:, j]))
            assert macs[i, j] == pytest.approx(mac(a[both, i], x[both, j])[0, 0])
    assert np.allclose(paired_mac(a, x), np.diag(macs))
    assert np.allclose(paired_mac(x, 3j * x), 1.0)
    assert mac(np.array([np.nan, 1.0]), np.array([1.0, np.nan]))[0, 0] == 0.0


def test_overall_error_is_zero_for_a_perfect_match_and_known_otherwise() -> None:
    assert mac_error(np.ones(7)) == 0.0
    assert mac_error(np.array([1.0, 0.0])) == pytest.approx(100 * (1 - np.sqrt(0.5)))
    with pytest.raises(InputError, match="between 0 and 1"):
        mac_error(np.array([1.2]))


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_comac_is_one_under_any_scale_and_sign_of_each_mode(seed: int) -> None:
    phi = shapes(seed, complex_=False)
    factor = np.random.default_rng(seed).standard_normal(4) * 10
    assert np.allclose(comac(phi, phi * factor), 1.0, atol=1e-12)
    other = comac(phi, shapes(seed + 1, complex_=False))
    assert np.all((other >= 0.0) & (other <= 1.0))


def test_comac_finds_the_channel_that_is_wrong() -> None:
    a = shapes(5, dofs=12, modes=5, complex_=False)
    x = a.copy()
    x[7] = np.random.default_rng(0).standard_normal(5)
    x[3, 2] = np.nan
    x[10] = np.nan
    values = comac(a, x)
    assert np.nanargmin(values) == 7
    assert np.isnan(values[10]) and np.isfinite(values[3])


def test_messages_say_what_to_do() -> None:
    with pytest.raises(InputError, match="restrict the model's shapes"):
        mac(np.ones((3, 2)), np.ones((4, 2)))
    with pytest.raises(InputError, match="pair them first"):
        comac(np.ones((3, 2)), np.ones((3, 1)))
    with pytest.raises(InputError, match="do not move"):
        modal_scale_factor(np.zeros((3, 1)), np.ones((3, 1)))
    with pytest.raises(InputError, match="infinite"):
        mac(np.array([np.inf, 1.0]), np.ones(2))
