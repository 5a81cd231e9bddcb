"""What a diagnosis draws of responses: magnitudes that keep their peaks, what remains against
noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.figures import extremes, responses_shown
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.diagnose.shown import Shown
from cvxupdate.physics import told
from cvxupdate.physics.place import Place
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from tests.cases.signals import signal_of
from tests.cases.three_masses import MASS, STIFFNESS, ZETA, chain

LINES = np.arange(5.0, 75.0, 0.05)
FACTOR, NOISE = 1.21, 1e-3


def recording(use: str, reference: int) -> FrequencyResponse:
    """The chain with its second spring stiffer, by dense inversion, with noise; the third channel
    hears next to nothing."""
    a, b, c = STIFFNESS[0], FACTOR * STIFFNESS[1], STIFFNESS[2]
    K, M = np.array([[a + b, -b, 0], [-b, b + c, -c], [0, -c, c]]), np.diag(MASS)
    lam, phi = np.linalg.eigh(np.diag(np.diag(M) ** -0.5) @ K @ np.diag(np.diag(M) ** -0.5))
    phi = np.diag(np.diag(M) ** -0.5) @ phi
    C = M @ phi @ np.diag(2 * ZETA * np.sqrt(lam)) @ phi.T @ M
    s = 2j * np.pi * LINES[:, None, None]
    H = (s**2 * np.linalg.inv(s**2 * M + s * C + K))[:, :, [reference - 1]]
    std = NOISE * np.sqrt(np.mean(np.abs(H) ** 2, axis=0, keepdims=True)) * np.ones(H.shape)
    rng = np.random.default_rng(reference)
    H = H + std * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    H[:, 2] *= 1e-9
    std[:, 2] = 1.0
    channels = tuple(Channel(n, "x", "acceleration") for n in (1, 2, 3))
    return FrequencyResponse(
        Origin(f"{use} {reference}", "lab", use),
        LINES,
        H,
        "acceleration",
        channels,
        (Channel(reference, "x", "force"),),
        std**2,
    )


@pytest.fixture(scope="module")
def shown() -> Shown:
    model = undamped(chain())
    fitted, held = ((signal_of(recording(use, n)),) for use, n in (("fit", 1), ("hold-out", 2)))
    setting = setting_for(model, chain(), fitted, 75.0)

    def at(p: float) -> ResponsePoint:
        values: NDArray[np.float64] = np.zeros(len(setting.columns))
        values[0] = p
        return setting.evaluate(values)

    near, far = (
        told("added_mass", Place(nodes=(2,))),
        told("stiffness_change", Place(elements=(2,))),
    )
    return responses_shown(at(0.0), at(FACTOR - 1.0), fitted, held, [(near, 0.3), (far, 0.9)])


def test_the_first_curve_is_held_out_and_falls_on_the_measurement(shown: Shown) -> None:
    first = shown.curves[0]
    assert (
        first.use == "hold-out"
        and first.sensor in ("n1.x", "n2.x")
        and first.driven == ("n2.x",)
        and first.per_force
    )
    assert (
        first.quantity == "acceleration"
        and len(first.frequency) <= 600
        and np.all(np.diff(first.frequency) > 0)
    )
    size = np.linalg.norm(first.measured)
    assert (
        np.linalg.norm(first.after - first.measured)
        < 0.02 * size
        < 0.2 * size
        < np.linalg.norm(first.before - first.measured)
    )
    assert first.measured.max() == pytest.approx(
        np.abs(recording("hold-out", 2).H[:, int(first.sensor[1]) - 1]).max(), rel=1e-12
    )  # no peak is lost
    assert [c.use for c in shown.curves] == ["hold-out"] * 2 + [
        "fit"
    ] * 2  # the channel that hears nothing is not drawn


def test_what_remains_is_noise_after_and_more_before(shown: Shown) -> None:
    held, fitted = shown.spectra
    assert (held.use, fitted.use) == ("hold-out", "fit")
    for s in (held, fitted):
        assert s.noise == pytest.approx(
            NOISE, rel=1e-3
        )  # the same at every line, relative to a channel that has it too
        assert np.sqrt(np.mean(s.after**2)) < 3 * NOISE < 0.1 < np.sqrt(np.mean(s.before**2))


def test_recordings_that_hear_nothing_are_not_drawn() -> None:
    """Every channel below its noise: no curve, no spectrum, no error."""
    model = undamped(chain())
    deaf = recording("fit", 1)
    signals = (signal_of(replace(deaf, H=1e-9 * deaf.H, variance=np.ones(deaf.H.shape))),)
    setting = setting_for(model, chain(), signals, 75.0)
    point = setting.evaluate(np.zeros(len(setting.columns)))
    assert responses_shown(point, point, signals, (), []) == Shown()


def test_extremes_keep_peaks_and_dips() -> None:
    values = np.random.default_rng(0).normal(size=5000)
    values[1234], values[4321] = 50.0, -50.0
    found = extremes(values, 100)
    assert {1234, 4321} <= set(found.tolist()) and len(found) <= 100 and np.all(np.diff(found) > 0)
    assert extremes(values[:80], 100).tolist() == list(range(80))


def test_signals_are_what_the_curves_say(shown: Shown) -> None:
    signal: Signal = signal_of(recording("fit", 1))
    curve = next(c for c in shown.curves if c.use == "fit")
    k = signal.sensors.index(curve.sensor)
    at = np.searchsorted(LINES, curve.frequency - 1e-9)
    np.testing.assert_allclose(curve.measured, np.abs(signal.Y[at, k, 0]), rtol=1e-12)
    np.testing.assert_allclose(curve.noise, signal.std[at, k, 0], rtol=1e-12)
