"""FRF measures and frequency errors: closed forms and identities."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.correlate import (
    fdac,
    frac,
    frequency_errors,
    frequency_scatter,
    frf_correlation,
    frf_error,
    frf_errors,
    mac,
)
from cvxupdate.errors import InputError


def random(seed, shape=(30, 5, 2)):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


@given(st.integers(0, 1000), st.floats(1e-3, 1e3), st.floats(-3, 3))
@settings(max_examples=30, deadline=None)
def test_frac_and_fdac_do_not_see_scale_or_phase_and_the_error_does(seed, scale, phase):
    H = random(seed)
    c = scale * np.exp(1j * phase)
    assert np.allclose(frac(H, c * H), 1.0) and np.allclose(np.diagonal(fdac(H, c * H)), 1.0)
    assert np.allclose(frf_errors(c * H, H), abs(c - 1))
    assert frf_error(c * H, H) == pytest.approx(abs(c - 1))
    assert np.allclose(frf_errors(c * H, H, "model"), abs(c - 1) / abs(c))
    other = fdac(H, random(seed + 1))
    assert other.shape == (30, 30, 2) and np.all((other >= 0) & (other <= 1))


def test_fdac_is_the_mac_of_response_shapes_on_two_axes():
    a, x = random(0, (7, 5, 2)), random(1, (9, 5, 2))
    both = fdac(a, x)
    for j in range(2):
        assert np.allclose(both[:, :, j], mac(a[:, :, j].T, x[:, :, j].T))
    x[3, 2, 0] = np.nan
    assert np.allclose(fdac(a, x)[:, :, 0], mac(a[:, :, 0].T, x[:, :, 0].T))


def test_the_ridge_of_fdac_shows_the_shift_of_frequency():
    """A model that is 10 % too stiff everywhere: its responses at √1.1 f have the measured shapes
    at f."""
    k = 1e4 * np.array([[3.0, -1, 0], [-1, 2.5, -1.5], [0, -1.5, 1.5]])
    m = np.diag([1.0, 2.0, 1.5])
    f = np.linspace(5, 60, 111)

    def H(factor):
        return np.array(
            [np.linalg.inv(factor * k * (1 + 0.02j) - (2 * np.pi * v) ** 2 * m)[:, :1] for v in f]
        )

    both = fdac(H(1.1), H(1.0))[:, :, 0]
    for j in (10, 40, 70):
        ridge = f[np.argmax(both[:, j])]
        assert ridge == pytest.approx(np.sqrt(1.1) * f[j], abs=0.5)


def test_lines_without_a_value_are_left_out():
    a, x = random(2), random(3)
    x[4, 1, 0] = np.nan
    keep = np.delete(np.arange(30), 4)
    assert frf_errors(a, x)[1, 0] == pytest.approx(frf_errors(a[keep], x[keep])[1, 0])
    assert frac(a, x)[1, 0] == pytest.approx(frac(a[keep], x[keep])[1, 0])
    x[:, 2, 1] = np.nan
    assert np.isnan(frf_errors(a, x)[2, 1]) and np.isnan(frac(a, x)[2, 1])


def test_the_summary_is_json_and_thins_the_map():
    a, x = random(4), random(5)
    x[:, 2, 1] = np.nan
    out = frf_correlation(np.linspace(0, 10, 30), a, x, lines=12)
    assert out.fdac.shape == (12, 12, 2) and out.lines[0] == 0 and out.lines[-1] == 10
    data = json.loads(json.dumps(out.to_json()))
    assert data["frac"][2][1] is None and data["total"] == pytest.approx(out.total)


def test_frequency_errors_and_scatter():
    fa, fx = np.array([11.0, 18.0]), np.array([10.0, 20.0])
    assert np.allclose(frequency_errors(fa, fx), [10.0, -10.0])
    assert np.allclose(frequency_errors(fa, fx, "model"), [100 / 11, -200 / 18])
    assert frequency_scatter(fa, fx) == pytest.approx(100 * np.sqrt(5 / 500))
    assert frequency_scatter(fa, fx, "model") == pytest.approx(100 * np.sqrt(5 / (121 + 324)))
    assert np.allclose(frequency_errors(1.07 * fx, fx), 7.0) and frequency_scatter(
        1.07 * fx, fx
    ) == pytest.approx(7.0)


def test_bad_input_is_named():
    with pytest.raises(InputError, match="rigid-body"):
        frequency_errors(np.array([1.0]), np.array([0.0]))
    with pytest.raises(InputError, match="paired"):
        frequency_scatter(np.ones(2), np.ones(3))
    with pytest.raises(InputError, match="reference must be"):
        frequency_errors(np.ones(2), np.ones(2), "both")
    with pytest.raises(InputError, match="measured lines"):
        frac(random(0), random(0, (29, 5, 2)))
    with pytest.raises(InputError, match="lines, responses, references"):
        frf_error(np.ones((3, 2)), np.ones((3, 2)))
    with pytest.raises(InputError, match="responses and references differ"):
        fdac(random(0), random(0, (30, 4, 2)))
    with pytest.raises(InputError, match="frequencies for"):
        frf_correlation(np.ones(3), random(0), random(0))
