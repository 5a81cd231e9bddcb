"""The error of a nonlinear model against time histories, which it answers by simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cvxupdate.correlate import response_errors
from cvxupdate.correlate.compare import nonlinear_note
from cvxupdate.correlate.responses import compare_responses
from cvxupdate.recordings.types import Channel, Origin, TimeHistory
from tests.cases.elements import build, nodes

K3, RATE, LENGTH = 4.0e5, 200.0, 1200


def chain(*elements: dict):
    return build(
        {
            "dofs": ["x"],
            "nodes": nodes([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]]),
            "elements": [
                {
                    "type": "spring",
                    "dof": "x",
                    "rows": [
                        {"id": 1, "nodes": [1, 2], "k": 3000.0},
                        {"id": 2, "nodes": [2, 3], "k": 2000.0},
                    ],
                },
                {
                    "type": "mass",
                    "rows": [{"id": 3, "nodes": [2], "m": 1.0}, {"id": 4, "nodes": [3], "m": 1.4}],
                },
                {"type": "dashpot", "dof": "x", "c": 3.0, "rows": [{"id": 5, "nodes": [2, 3]}]},
                *elements,
            ],
            "supports": [{"nodes": [1], "dofs": ["x"]}],
        }
    )


HARDENING = {"type": "cubic_spring", "dof": "x", "rows": [{"id": 9, "nodes": [1, 2], "k3": K3}]}


@pytest.fixture(scope="module")
def history():
    """Recorded by scipy: K, M and C written down, the force straight between samples."""
    rng = np.random.default_rng(5)
    t = np.arange(LENGTH) / RATE
    spectrum = np.fft.rfft(rng.normal(size=LENGTH))
    spectrum[np.fft.rfftfreq(LENGTH, 1.0 / RATE) > 15.0] = 0.0
    force = 150.0 * np.fft.irfft(spectrum, LENGTH) * np.minimum(1.0, t)
    K = np.array([[5000.0, -2000.0], [-2000.0, 2000.0]])
    C, m = np.array([[3.0, -3.0], [-3.0, 3.0]]), np.array([1.0, 1.4])

    def rate(now, y):
        f = np.array([-K3 * y[0] ** 3, np.interp(now, t, force)])
        return np.concatenate([y[2:], (f - K @ y[:2] - C @ y[2:]) / m])

    y = solve_ivp(rate, (0, t[-1]), np.zeros(4), t_eval=t, rtol=1e-8, atol=1e-11, max_step=0.005).y
    channels = (
        Channel(3, "x", "force"),
        Channel(2, "x", "displacement"),
        Channel(3, "x", "displacement"),
    )
    data = np.column_stack([force, y[0], y[1]])
    return TimeHistory(Origin("ring", "scipy"), RATE, channels, data, (1.0, 15.0))


@pytest.mark.slow
def test_the_right_law_has_no_error_and_the_linear_model_has(history):
    linear = response_errors(chain(), [history])["fit"]["response_error"]
    right = response_errors(chain(HARDENING), [history])["fit"]["response_error"]
    assert right < 2e-3 < 0.05 < linear
    held = replace(history, origin=replace(history.origin, use="hold-out"))
    assert response_errors(chain(HARDENING), [held])["hold_out"]["response_error"] == right


@pytest.mark.parametrize("band", [(1.0, 15.0), None])
def test_correlate_says_so_and_shows_the_simulation(history, band):
    model, history = chain(HARDENING), replace(history, band=band)
    (note,) = nonlinear_note(model)
    assert "cubic_spring" in note and "simulated" in note and nonlinear_note(chain()) == []
    shown, _, (error,) = compare_responses(model, history)
    assert shown is not None and error.value < 2e-3
    assert shown.correlation.total < 0.02 or band is None  # without a band, H1 of lines unexcited
