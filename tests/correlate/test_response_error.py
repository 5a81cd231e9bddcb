"""The error of the responses: its laws on a small structure of unequal spans with every kind of
damping, on FRFs and on time histories."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim, fftconvolve

from cvxupdate.correlate import response_errors
from cvxupdate.correlate.response_error import Stated, modelled, pooled, stated_errors, together
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.recordings.measured import (
    band_of,
    decaying_spectra,
    excited_band,
    measured_responses,
)
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, TimeHistory
from cvxupdate.study import open_problem

TEXT = """
title = "chain"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.3 }, { id = 3, x = 0.8 }, { id = 4, x = 1.5 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [
  { id = 1, nodes = [1, 2], k = 9000.0 }, { id = 2, nodes = [2, 3], k = 5000.0 },
  { id = 3, nodes = [3, 4], k = 7000.0 },
]
[[model.elements]]
type = "mass"
rows = [
  { id = 4, nodes = [2], m = 1.0 }, { id = 5, nodes = [3], m = 0.6 },
  { id = 6, nodes = [4], m = 1.7 },
]
[[model.elements]]
type = "dashpot"
dof = "x"
rows = [{ id = 7, nodes = [3], c = 4.0 }]
[[model.supports]]
nodes = [1]
dofs = ["x"]
[model.damping]
kind = "rayleigh"
alpha = 0.3
beta = 1e-4
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("chain") / "problem.toml"
    path.write_text(TEXT, encoding="utf-8")
    return open_problem(path)[1]


def motion(node, quantity="acceleration"):
    return Channel(node, "x", quantity)


def frf_of(model, factor=1.0, quantity="acceleration", use="fit", lines=None):
    f = np.linspace(0.0, 30.0, 301) if lines is None else lines
    outs, ins = np.array([0, 1, 2]), np.array([2])
    H = factor * frequency_responses(model, f, outs, ins, quantity)
    channels = tuple(motion(n, quantity) for n in (2, 3, 4))
    return FrequencyResponse(Origin("t", "t", use), f, H, quantity, channels, (motion(4, "force"),))


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_a_model_has_no_error_against_itself_and_a_gain_is_its_error(model, quantity):
    assert response_errors(model, [frf_of(model, quantity=quantity)])["fit"]["frf_error"] < 1e-9
    for gain in (1.1, 0.5):
        found = response_errors(model, [frf_of(model, gain, quantity)])
        assert found == {
            "fit": {"frf_error": pytest.approx(abs(1.0 - gain) / gain)},
            "hold_out": {},
        }


def test_it_is_the_frobenius_ratio_in_the_recorded_quantity(model):
    """Not the mean over channels, and not that of the receptances."""
    frf = frf_of(model)
    rng = np.random.default_rng(0)
    wrong = frf.H + 0.1 * rng.standard_normal(frf.H.shape) * np.array([1.0, 5.0, 20.0])[:, None]
    lines = frf.frequency > 0.0
    ratio = np.linalg.norm((frf.H - wrong)[lines]) / np.linalg.norm(wrong[lines])
    found = response_errors(model, [replace(frf, H=wrong)])["fit"]["frf_error"]
    assert found == pytest.approx(ratio)
    s = 2j * np.pi * frf.frequency[lines, None, None]
    receptances = np.linalg.norm((frf.H - wrong)[lines] / s**2) / np.linalg.norm(
        wrong[lines] / s**2
    )
    assert abs(found - receptances) > 0.05 * found


def test_of_several_recordings_it_is_the_rms_and_uses_stay_apart(model):
    frfs = [frf_of(model, g) for g in (1.1, 2.0)] + [frf_of(model, 0.5, use="hold-out")]
    each = [abs(1.0 - g) / g for g in (1.1, 2.0)]
    found = response_errors(model, frfs)
    assert found["fit"]["frf_error"] == pytest.approx(np.sqrt(np.mean(np.square(each))))
    assert found["hold_out"]["frf_error"] == pytest.approx(1.0)
    stated = (Stated("fit", "frf_error", 0.3), Stated("fit", "response_error", 0.4))
    assert pooled(stated)["fit"] == {"frf_error": 0.3, "response_error": 0.4}
    assert together(stated, "fit") == pytest.approx(np.sqrt(0.125))
    assert np.isnan(together(stated, "hold-out"))


def test_a_held_dof_answers_nothing_and_what_is_no_motion_is_left_out(model):
    frf = frf_of(model)
    held = replace(
        frf,
        H=np.concatenate([frf.H, frf.H[:, :1]], axis=1),
        responses=(*frf.responses, motion(1)),
    )
    size = np.linalg.norm(held.H[1:])
    expected = np.linalg.norm(frf.H[1:, :1]) / size
    assert response_errors(model, [held])["fit"]["frf_error"] == pytest.approx(expected)
    strained = replace(held, responses=(*frf.responses, motion(1, "strain")))
    assert response_errors(model, [strained])["fit"]["frf_error"] < 1e-9
    unforced = replace(frf, references=(Channel(0, "", "unknown"),))
    assert measured_responses(unforced) == () and response_errors(model, [unforced])["fit"] == {}


def test_an_undamped_model_has_no_bound_at_its_own_frequency(model, tmp_path):
    path = tmp_path / "problem.toml"
    path.write_text(
        TEXT[: TEXT.index("[model.damping]")].replace("c = 4.0", "c = 0.0"), encoding="utf-8"
    )
    bare = open_problem(path)[1]
    (error,) = stated_errors(bare, [frf_of(model, lines=np.array([5.0, 9.0]))])
    assert np.isfinite(error.value)
    free = replace(bare, blocks=tuple(b for b in bare.blocks if b.kind.name != "spring"))
    (error,) = stated_errors(free, [frf_of(model, lines=np.array([5.0, 9.0]))])
    assert np.isfinite(error.value)  # masses alone: a = F/m at every line


def history_of(model, quantities, rate=2000.0, seconds=8.0, factor=1.0, **more):
    """Exact for a force held between samples; the samples are those of the continuous motion."""
    m = model.matrices()
    K, M, C = (A.toarray() for A in (m.K, m.M, m.C))
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ K, -inverse @ C]])
    B = np.concatenate([np.zeros(3), inverse[:, 2]])[:, None]
    rng = np.random.default_rng(5)
    n = int(rate * seconds)
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    f = np.fft.rfftfreq(n, 1.0 / rate)
    inside = (f > 2.0) & (f < 40.0)
    spectrum[inside] = np.exp(2j * np.pi * rng.random(inside.sum()))
    t = np.arange(n) / rate
    force = np.fft.irfft(spectrum, n) * np.clip(t / 0.5, 0.0, 1.0) * n
    system = cont2discrete((A, B, np.eye(6), np.zeros((6, 1))), 1.0 / rate, "foh")
    _, out, _ = dlsim(system, force)
    rows = {"displacement": out[:, :3], "velocity": out[:, 3:]}
    rows["acceleration"] = (force[:, None] * B[3:].T) + out @ A[3:].T
    data = np.hstack([force[:, None], *(factor * rows[q] for q in quantities)])
    channels = (motion(4, "force"), *(motion(n, q) for q in quantities for n in (2, 3, 4)))
    return TimeHistory(Origin("t", "t"), rate, channels, data, **more)


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_a_record_that_starts_from_rest_is_met_without_window_or_average(model, quantity):
    exact = history_of(model, [quantity])
    assert response_errors(model, [exact])["fit"]["response_error"] < 2e-3
    louder = response_errors(model, [history_of(model, [quantity], factor=1.25)])
    assert louder["fit"]["response_error"] == pytest.approx(0.2, abs=2e-3)


def test_each_quantity_of_a_record_counts_as_a_recording(model):
    both = history_of(model, ["acceleration", "displacement"])
    errors = stated_errors(model, [both])
    assert len(errors) == 2 and {e.metric for e in errors} == {"response_error"}
    spoilt = replace(both, data=np.hstack([both.data[:, :4], 2.0 * both.data[:, 4:]]))
    found = response_errors(model, [spoilt])["fit"]["response_error"]
    assert found == pytest.approx(np.sqrt(0.5) * 0.5, abs=2e-3)


def test_the_band_is_the_tables_own_or_what_the_excitation_reached(model):
    free = history_of(model, ["acceleration"], rate=200.0)
    low, high = band_of(free)
    assert (low, high) == excited_band(free) and 1.0 < low < 4.0 and 35.0 < high < 45.0
    named = replace(free, band=(5.0, 12.0))
    assert band_of(named) == (5.0, 12.0) and excited_band(named) == (low, high)
    (measured,) = measured_responses(named)
    f = measured.s.imag / (2 * np.pi)
    assert f.min() >= 5.0 and f.max() <= 12.0 and np.diff(f) == pytest.approx(1.0 / 8.0)
    assert measured.s.real == pytest.approx(7.0 / 8.0)
    frf = frf_of(model)
    assert band_of(frf) == (frf.frequency[1], 30.0)
    assert modelled(model, measured_responses(frf)[0]).shape == (300, 3, 1)


def test_decaying_spectra_are_the_laplace_transform():
    """Of e^{−at} sampled finely: 1 / (s + a)."""
    rate, n = 4000.0, 40000
    t = np.arange(n) / rate
    x = np.exp(-3.0 * t)
    history = TimeHistory(Origin("t", "t"), rate, (motion(2),), x[:, None])
    s, spectra = decaying_spectra(history, (1.0, 20.0))
    assert spectra[:, 0] == pytest.approx(1.0 / (s + 3.0), rel=1e-3)


def test_the_first_instant_is_a_step_a_swing_or_a_blow():
    """Of what jumps or swings there, up to three samples a period, where half of the first sample
    leaves 30 % of a jump; of one sample, its momentum."""
    rate, n = 400.0, 4000
    t = np.arange(n) / rate
    channels = (replace(motion(2), quantity="force"),)
    blow = np.zeros(n)
    blow[0] = rate
    w = 2.0 * np.pi * 60.0
    cases = (
        (np.exp(-t), lambda s: 1.0 / (s + 1.0), 5e-2),
        (np.cos(w * t), lambda s: s / (s**2 + w**2), 5e-2),
        (np.sin(w * t), lambda s: w / (s**2 + w**2), 5e-2),
        (blow, np.ones_like, 1e-12),
    )
    for x, truth, most in cases:
        history = TimeHistory(Origin("t", "t"), rate, channels, x[:, None])
        s, spectra = decaying_spectra(history, (20.0, 130.0))
        assert np.allclose(spectra[:, 0], truth(s), rtol=most, atol=0.0)


def test_two_runs_of_a_linear_structure_agree_though_their_forces_set_in():
    """Of an oscillator under two multisines that begin at their full strength."""
    rate, n, fine = 500.0, 8000, 16
    t = np.arange(n * fine) / (rate * fine)
    impulse = np.exp(-0.02 * 250.0 * t) * np.sin(250.0 * t) / 250.0
    found = []
    for phase in (0.7, 1.3):
        force = np.sum([np.cos(2.0 * np.pi * f * t + phase * f**2) for f in range(20, 70)], axis=0)
        y = fftconvolve(impulse, force)[: len(t)] / (rate * fine)
        y -= 0.5 * force[0] * impulse / (rate * fine)  # the convolution by the same rule
        channels = (replace(motion(2), quantity="force"), motion(2))
        data = np.column_stack([force, y])[::fine]
        history = TimeHistory(Origin("t", "t"), rate, channels, data)
        _, spectra = decaying_spectra(history, (20.0, 70.0))
        found.append(spectra)
    (u, y), (w, z) = (x.T for x in found)
    assert np.linalg.norm(y * w - z * u) < 1e-3 * np.linalg.norm(y * w)
