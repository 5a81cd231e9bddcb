"""Poles of the time domain: exact without noise, near the truth with it, honest where they cannot
be had."""

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify import identify_modes, modal_frf
from cvxupdate.recordings.identify.realisation import time_domain_poles
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin

FREQUENCY = np.array([35.0, 52.0, 75.0, 77.0, 98.0, 133.0, 171.0])
ZETA = np.array([0.01, 0.006, 0.008, 0.005, 0.02, 0.004, 0.007])
LINES = np.linspace(20.0, 200.0, 721)


def responses(quantity="displacement", lines=LINES):
    """Seven modes at six places by two forces, two of the modes close; irregular shapes."""
    rng = np.random.default_rng(4)
    poles = 2.0 * np.pi * FREQUENCY * (-ZETA + 1j * np.sqrt(1.0 - ZETA**2))
    shapes = rng.standard_normal((7, 6)) + 0.1j * rng.standard_normal((7, 6))
    scale = 1.0 / (2j * poles.imag)
    return modal_frf(lines, poles, shapes * scale[:, None], shapes[:, :2], quantity=quantity)


def frf_of(H, lines=LINES, quantity="displacement"):
    return FrequencyResponse(
        Origin("seven", "test"),
        lines,
        H,
        quantity,
        tuple(Channel(k + 1, "z", quantity) for k in range(6)),
        tuple(Channel(k + 1, "z", "force") for k in range(2)),
    )


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
@pytest.mark.parametrize("method", ["realisation", "ibrahim"])
def test_poles_without_noise_are_those_of_the_structure(method, quantity):
    sets = time_domain_poles(LINES, responses(quantity), orders=np.array([30, 40]), method=method)
    truth = 2.0 * np.pi * FREQUENCY * (-ZETA + 1j * np.sqrt(1.0 - ZETA**2))
    for found in sets:
        nearest = found.poles[np.argmin(np.abs(found.poles[:, None] - truth), axis=0)]
        assert np.abs(nearest - truth).max() / np.abs(truth).min() < 2e-3
        assert np.all(found.poles.real < 0.0)


@pytest.mark.parametrize("method", ["realisation", "ibrahim"])
def test_modes_with_noise(method):
    H = responses()
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    H = H + 0.005 * np.sqrt(np.mean(np.abs(H) ** 2)) * noise
    found = identify_modes(frf_of(H), poles=method, max_order=40, iterations=0)
    assert np.allclose(found.frequency, FREQUENCY, rtol=2e-3)
    assert np.allclose(found.damping, ZETA, rtol=0.25)


def test_uneven_lines_have_no_impulse_response():
    lines = np.sort(np.concatenate([LINES, LINES[:200] + 0.01]))
    with pytest.raises(RecordingError, match="not evenly spaced.*plscf"):
        identify_modes(frf_of(responses(lines=lines), lines), poles="ibrahim")
